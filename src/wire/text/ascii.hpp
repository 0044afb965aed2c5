// SPDX-License-Identifier: Apache-2.0
// Letters of ASCII, where a protocol lets either case stand for the other.
#pragma once
#include <algorithm>
#include <string_view>

namespace rowe::wire {

constexpr char lower(char c) noexcept {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
}

constexpr bool equal_ignoring_case(std::string_view a, std::string_view b) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

} // namespace rowe::wire
