// SPDX-License-Identifier: Apache-2.0
// A walk over text that is known to be valid JSON, so every character tells what comes next and nothing is
// checked.
#include "json_outline.hpp"

#include <algorithm>
#include <cstddef>

#include "console.hpp"

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
    switch (peek()) {
    case '{': object(depth); break;
    case '[': array(depth); break;
    default: behind_key(scalar());
    }
  }

  void object(std::size_t depth) {
    take('{');
    if (peek() == '}') behind_key("{}");
    while (peek() != '}') {
      const std::string token = scalar();
      const auto key = std::string_view{token}.substr(1, token.size() - 2);
      begin_line(depth);
      text_.append(is_plain_key(key) ? key : std::string_view{token}).append(":");
      take(':');
      value(depth + 1);
      if (peek() == ',') take(',');
    }
    take('}');
  }

  void array(std::size_t depth) {
    if (holds_scalars_only()) return scalars();
    take('[');
    while (peek() != ']') {
      begin_line(depth);
      text_ += '-';
      value(depth + 1);
      if (peek() == ',') take(',');
    }
    take(']');
  }

  void scalars() {
    std::string list = "[";
    take('[');
    while (peek() != ']') {
      list.append(list.size() == 1 ? "" : ", ").append(scalar());
      if (peek() == ',') take(',');
    }
    take(']');
    behind_key(list += ']');
  }

  // Whether the array ahead has no object or array in it.
  bool holds_scalars_only() const {
    outline ahead{rest_};
    ahead.take('[');
    while (ahead.peek() != ']') {
      if (ahead.peek() == '{' || ahead.peek() == '[') return false;
      (void)ahead.scalar();
      if (ahead.peek() == ',') ahead.take(',');
    }
    return true;
  }

  // The next string, number or word, as it is spelt.
  std::string scalar() {
    (void)peek();
    std::size_t end = 1;
    if (rest_.front() == '"') {
      while (rest_[end] != '"') end += rest_[end] == '\\' ? 2U : 1U;
      ++end;
    } else {
      end = std::min(rest_.find_first_of(",]} \t\r\n"), rest_.size());
    }
    const std::string_view token = rest_.substr(0, end);
    rest_.remove_prefix(end);
    return printable(token);
  }

  // The next character that is no white space.
  char peek() noexcept {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    return rest_.front();
  }
  void take(char) noexcept {
    (void)peek();
    rest_.remove_prefix(1);
  }

  void begin_line(std::size_t depth) { text_.append("\n").append(2 * depth, ' '); }
  void behind_key(std::string_view scalar) { text_.append(text_.empty() ? "" : " ").append(scalar); }

  std::string_view rest_;
  std::string text_;
};

} // namespace

std::string outline_of(std::string_view json) { return outline{json}.write(); }

} // namespace rowe::tools
