// SPDX-License-Identifier: Apache-2.0
// Undoes percent-encoding (RFC 3986, 2.1), of paths and of forms. Pure; any thread; never waits or allocates.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "wire/text/ascii.hpp"

namespace rowe::wire {

constexpr int hex_value(char digit) noexcept {
  if (digit >= '0' && digit <= '9') return digit - '0';
  const char low = lower(digit);
  return low >= 'a' && low <= 'f' ? low - 'a' + 10 : -1;
}

// Writes the text to `out`, as much of it as fits, and returns what was written. Nothing where a % has no two
// digits behind it. `plus` is what a + stands for: a blank in forms, itself in paths.
constexpr std::optional<std::string_view> undo_percent(std::span<char> out, std::string_view text,
                                                       char plus = '+') noexcept {
  std::size_t bytes = 0;
  while (!text.empty() && bytes < out.size()) {
    char one = text.front() == '+' ? plus : text.front();
    std::size_t taken = 1;
    if (one == '%') {
      const int high = text.size() > 2 ? hex_value(text[1]) : -1;
      const int low = text.size() > 2 ? hex_value(text[2]) : -1;
      if (high < 0 || low < 0) return std::nullopt;
      one = static_cast<char>(high << 4 | low);
      taken = 3;
    }
    out[bytes++] = one;
    text.remove_prefix(taken);
  }
  return std::string_view{out.data(), bytes};
}

} // namespace rowe::wire
