// SPDX-License-Identifier: Apache-2.0
// How `rowe echo` and `rowe call` write a message: for people, as JSON, or as a table.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

// A text on one line: the line breaks that JSON allows between its tokens become blanks. (Inside strings it
// has none.)
std::string on_one_line(std::string_view json);

class message_format {
 public:
  enum class kind : std::size_t {
    pretty, // indented, each followed by a line `---`
    json,   // as it came, one a line
    csv,    // RFC 4180 with line feeds: the members' paths once, then a row for each message
  };

  // `field`: the path of the one part that is wanted; empty: all. `named`: there are several topics, so each
  // message says which one it is of (pretty and json only).
  message_format(kind how, std::string field, bool named)
      : how_{how}, field_{std::move(field)}, named_{named} {}

  // The text for stdout, lines and all. Nothing: the message has no such field.
  std::optional<std::string> text_of(std::string_view topic, json_value body);

  // Rows whose paths were not those of the header: what was new there was left out, what was missing is
  // empty.
  std::size_t odd_rows() const noexcept { return odd_rows_; }

 private:
  std::string rows_of(json_value value);

  kind how_;
  std::string field_;
  bool named_;
  std::vector<std::string> header_;
  std::size_t odd_rows_ = 0;
};

} // namespace rowe::tools
