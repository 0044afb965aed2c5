// SPDX-License-Identifier: Apache-2.0
// Undoes percent-encoding (RFC 3986, 2.1), of paths and of forms. Pure; any thread; never waits or allocates.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "json/text/characters.hpp"

namespace rowe::wire {

// Writes the text to `out`, as much of it as fits, and returns what was written. Nothing where a % has no two
// digits behind it. `plus` is what a + stands for: a blank in forms, itself in paths.
constexpr std::optional<std::string_view> undo_percent(std::span<char> out, std::string_view text,
                                                       char plus = '+') noexcept {
  std::size_t bytes = 0;
  while (!text.empty() && bytes < out.size()) {
    char one = text.front() == '+' ? plus : text.front();
    std::size_t taken = 1;
    if (one == '%') {
      const unsigned high = text.size() > 2 ? json::hex_value(text[1]) : 16;
      const unsigned low = text.size() > 2 ? json::hex_value(text[2]) : 16;
      if (high > 15 || low > 15) return std::nullopt;
      one = static_cast<char>(high << 4 | low);
      taken = 3;
    }
    out[bytes++] = one;
    text.remove_prefix(taken);
  }
  return std::string_view{out.data(), bytes};
}

} // namespace rowe::wire
