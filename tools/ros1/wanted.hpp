// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace rowe::ros1 {

// Names that the user asked for: patterns as a shell has them, where `*` matches `/`, too. Behind a name may
// stand `=package/Type`.
class wanted_names {
 public:
  // Empty, or what is wrong with one of them.
  std::string set(const std::vector<std::string>& patterns);

  bool empty() const noexcept { return all_.empty(); }
  // Whether the user wrote the name itself, not a pattern.
  bool names(std::string_view name) const;
  bool match(std::string_view name) const;
  // The type that the user gave to it; empty: none.
  std::string type_of(std::string_view name) const;

  struct one {
    std::string pattern;
    std::string type;
    bool is_name = false;
  };
  const std::vector<one>& all() const noexcept { return all_; }

 private:
  std::vector<one> all_;
};

} // namespace rowe::ros1
