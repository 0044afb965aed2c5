// SPDX-License-Identifier: Apache-2.0
// Looks at eight bytes of text at once, in an ordinary register, in the same way on every machine.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <rowe/rt/attributes.hpp>

namespace rowe::json {

static_assert(std::endian::native == std::endian::little,
              "the first byte of a text must be the lowest of a word");

ROWE_RT inline std::uint64_t load_eight(const char* at) noexcept {
  std::uint64_t word;
  std::memcpy(&word, at, 8);
  return word;
}

// `bytes` (1 to 7) of text, and spaces behind them.
ROWE_RT inline std::uint64_t load_fewer(const char* at, std::size_t bytes) noexcept {
  constexpr std::uint64_t spaces = 0x2020'2020'2020'2020;
  std::uint64_t word = 0;
  if (bytes >= 4) {
    // Two loads that overlap: the bytes that both hold are the same ones.
    std::uint32_t first, last;
    std::memcpy(&first, at, 4);
    std::memcpy(&last, at + bytes - 4, 4);
    word = first | std::uint64_t{last} << (8 * (bytes - 4));
  } else {
    for (std::size_t i = bytes; i-- > 0;) word = word << 8 | static_cast<std::uint8_t>(at[i]);
  }
  return word | spaces << (8 * bytes);
}

inline constexpr std::uint64_t each_byte = 0x0101'0101'0101'0101;
inline constexpr std::uint64_t high_bits = 0x8080'8080'8080'8080;

// Marks the bytes that a JSON string must escape (control characters, quotes and backslashes) and those that
// are not ASCII, by their high bits. (Among ASCII bytes, only those below the subtracted value get it.) Bits
// above the first (lowest) marked byte may be wrong, because subtractions borrow. Bits up to it are right,
// and the answer is 0 exactly if there is no such byte.
ROWE_RT constexpr std::uint64_t special_bytes(std::uint64_t word) noexcept {
  const auto zero = [](std::uint64_t difference) { return difference - each_byte; };
  return (word | (word - each_byte * 0x20) | zero(word ^ each_byte * '"') | zero(word ^ each_byte * '\\')) &
         high_bits;
}

// The index of the first byte that is marked; the mask must not be 0.
ROWE_RT constexpr int first_byte(std::uint64_t marks) noexcept { return std::countr_zero(marks) / 8; }

} // namespace rowe::json
