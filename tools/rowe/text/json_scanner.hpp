// SPDX-License-Identifier: Apache-2.0
// A walk over text that is known to be valid JSON, so every character tells what comes next and nothing is
// checked. What it returns are pieces of the text, as they are spelt.
#pragma once
#include <algorithm>
#include <cstddef>
#include <string_view>

namespace rowe::tools {

class json_scanner {
 public:
  explicit json_scanner(std::string_view valid_json) noexcept : rest_{valid_json} {}

  // The next character that is no white space; '\0' at the end.
  char peek() noexcept {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    return rest_.empty() ? '\0' : rest_.front();
  }
  // Passes over it.
  void take() noexcept {
    (void)peek();
    rest_.remove_prefix(1);
  }
  // Passes over the comma, where one is next.
  void take_comma() noexcept {
    if (peek() == ',') take();
  }

  // The next string (with its quotes), number or word.
  std::string_view scalar() noexcept {
    (void)peek();
    std::size_t end = 1;
    if (rest_.front() == '"') {
      while (rest_[end] != '"') end += rest_[end] == '\\' ? 2U : 1U;
      ++end;
    } else {
      end = std::min(rest_.find_first_of(",]} \t\r\n"), rest_.size());
    }
    return cut(end);
  }

  // The next name of a member, as it is spelt between its quotes, and the colon behind it.
  std::string_view name() noexcept {
    const std::string_view token = scalar();
    take(); // ':'
    return token.substr(1, token.size() - 2);
  }

  // The next value, whole.
  std::string_view value() noexcept {
    if (const char first = peek(); first != '{' && first != '[') return scalar();
    std::size_t end = 0;
    std::size_t depth = 0;
    bool in_string = false;
    do {
      const char c = rest_[end++];
      if (in_string) {
        if (c == '\\') ++end;
        in_string = c != '"';
      } else if (c == '"') {
        in_string = true;
      } else if (c == '{' || c == '[') {
        ++depth;
      } else if (c == '}' || c == ']') {
        --depth;
      }
    } while (depth > 0);
    return cut(end);
  }

 private:
  std::string_view cut(std::size_t bytes) noexcept {
    const std::string_view piece = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return piece;
  }

  std::string_view rest_;
};

// Calls see(name, value) for each member of a valid object, both as they are spelt.
template <class See>
void for_each_member(std::string_view object, See&& see) {
  json_scanner rest{object};
  rest.take();
  while (rest.peek() != '}') {
    const std::string_view name = rest.name();
    see(name, rest.value());
    rest.take_comma();
  }
}

// Calls see(value) for each element of a valid array.
template <class See>
void for_each_element(std::string_view array, See&& see) {
  json_scanner rest{array};
  rest.take();
  while (rest.peek() != ']') {
    see(rest.value());
    rest.take_comma();
  }
}

} // namespace rowe::tools
