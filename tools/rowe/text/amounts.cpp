// SPDX-License-Identifier: Apache-2.0
#include "amounts.hpp"

#include <array>
#include <cstdio>

namespace rowe::tools {

std::uint64_t whole_of(double said) noexcept {
  if (!(said > 0)) return 0;
  return said >= 0x1p63 ? std::uint64_t{1} << 63U : static_cast<std::uint64_t>(said);
}

std::string bytes_text(std::uint64_t bytes) {
  constexpr std::array units{"B", "kB", "MB", "GB", "TB", "PB", "EB"};
  auto amount = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (amount >= 999.5 && unit + 1 < units.size()) {
    amount /= 1000;
    ++unit;
  }
  std::array<char, 32> text{};
  const int digits = unit == 0 || amount >= 99.95 ? 0 : amount >= 9.995 ? 1 : 2;
  const int length = std::snprintf(text.data(), text.size(), "%.*f %s", digits, amount, units[unit]);
  return {text.data(), static_cast<std::size_t>(length)};
}

} // namespace rowe::tools
