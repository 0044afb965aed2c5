// SPDX-License-Identifier: Apache-2.0
// Characters that texts are made of.
#pragma once

namespace rowe::json {

constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

// What JSON allows between its tokens.
constexpr bool is_white_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// The value of a hexadecimal digit; 16 if it is none.
constexpr unsigned hex_value(char c) noexcept {
  if (is_digit(c)) return static_cast<unsigned>(c - '0');
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? static_cast<unsigned>(lower - 'a' + 10) : 16;
}

} // namespace rowe::json
