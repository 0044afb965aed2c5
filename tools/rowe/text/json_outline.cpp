// SPDX-License-Identifier: Apache-2.0
#include "json_outline.hpp"

#include <algorithm>
#include <cstddef>

#include "../console.hpp"
#include "json_scanner.hpp"

namespace rowe::tools {
namespace {

bool is_plain_key(std::string_view key) noexcept {
  return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '/' || c == '.';
  });
}

class outline {
 public:
  explicit outline(std::string_view json) noexcept : rest_{json} {}

  std::string write() {
    value(0);
    const bool begins_below = text_.starts_with('\n');
    return (begins_below ? text_.substr(1) : text_) + '\n';
  }

 private:
  // Writes a value behind its key: scalars on the same line, what has members on lines of their own.
  void value(std::size_t depth) {
    switch (rest_.peek()) {
    case '{': object(depth); break;
    case '[': array(depth); break;
    default: behind_key(printable(rest_.scalar()));
    }
  }

  void object(std::size_t depth) {
    rest_.take();
    if (rest_.peek() == '}') behind_key("{}");
    while (rest_.peek() != '}') {
      const std::string key = printable(rest_.name());
      begin_line(depth);
      text_.append(is_plain_key(key) ? key : joined("\"", key, "\"")).append(":");
      value(depth + 1);
      rest_.take_comma();
    }
    rest_.take();
  }

  void array(std::size_t depth) {
    if (holds_scalars_only()) return scalars();
    rest_.take();
    while (rest_.peek() != ']') {
      begin_line(depth);
      text_ += '-';
      value(depth + 1);
      rest_.take_comma();
    }
    rest_.take();
  }

  void scalars() {
    std::string list = "[";
    rest_.take();
    while (rest_.peek() != ']') {
      list.append(list.size() == 1 ? "" : ", ").append(printable(rest_.scalar()));
      rest_.take_comma();
    }
    rest_.take();
    behind_key(list += ']');
  }

  // Whether the array ahead has no object or array in it.
  bool holds_scalars_only() const {
    json_scanner ahead = rest_;
    ahead.take();
    while (ahead.peek() != ']') {
      if (ahead.peek() == '{' || ahead.peek() == '[') return false;
      (void)ahead.scalar();
      ahead.take_comma();
    }
    return true;
  }

  void begin_line(std::size_t depth) { text_.append("\n").append(2 * depth, ' '); }
  void behind_key(std::string_view scalar) { text_.append(text_.empty() ? "" : " ").append(scalar); }

  json_scanner rest_;
  std::string text_;
};

} // namespace

std::string outline_of(std::string_view json) { return outline{json}.write(); }

} // namespace rowe::tools
