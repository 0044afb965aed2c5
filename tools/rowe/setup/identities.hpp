// SPDX-License-Identifier: Apache-2.0
// The identities in the text of a rowe.toml: who has a token. They are added and removed as whole tables
// [[identity]]; the rest of the text, comments and all, stays as it is, byte for byte.
//
// This is not a reader of TOML. It knows where tables begin, and which lines are inside a string or an array,
// and refuses a text in which identities are written in another way than as tables with plain strings.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>

namespace rowe::tools {

class identities_text {
 public:
  static std::optional<identities_text> read(std::string toml, std::string& wrong);

  const std::string& text() const noexcept { return text_; }
  std::vector<identity> all() const;

  // What is wrong with it, as check_access() says it; empty: it is there.
  std::string add(const identity& one);
  // False: there is none of this name.
  bool remove(std::string_view name);

 private:
  struct block {
    identity who;
    std::size_t begin; // of the table's own lines in the text
    std::size_t end;
  };
  explicit identities_text(std::string toml) : text_{std::move(toml)} {}
  std::string find();

  std::string text_;
  std::vector<block> blocks_;
  std::vector<role> roles_; // their names alone
};

// One identity as rowe.toml has it.
std::string toml_of(const identity& one);

} // namespace rowe::tools
