// SPDX-License-Identifier: Apache-2.0
// CBOR (RFC 8949): the pieces that it is written of, and JSON text as CBOR. Arrays of numbers of one type are
// typed arrays (RFC 8746), as rosbridge writes them. Pure functions, on any thread; nothing waits or
// allocates.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rowe::json {

class writer;

namespace cbor {

static_assert(std::endian::native == std::endian::little); // arrays are copied as they lie in memory

enum class major : std::uint8_t { whole, negative, bytes, text, array, map, tag };

inline constexpr std::size_t head_bytes_max = 9;
inline constexpr std::size_t array_head_bytes_max = 2 + head_bytes_max; // with the tag of a typed array
inline constexpr char no = '\xf4', yes = '\xf5', null = '\xf6';
inline constexpr char open_array = '\x9f', open_map = '\xbf', close = '\xff'; // of a length not said
inline constexpr std::size_t short_count_max = 23;                            // of a head of one byte

template <class Unsigned>
char* store_big_endian(char* at, Unsigned x) noexcept {
  for (std::size_t i = 0; i < sizeof x; ++i) at[i] = static_cast<char>(x >> 8 * (sizeof x - 1 - i));
  return at + sizeof x;
}

// A kind, and its number in as few bytes as hold it.
inline char* write_head(char* at, major kind, std::uint64_t n) noexcept {
  const auto bits = static_cast<unsigned>(kind) << 5;
  const auto begin = [&](unsigned form) { *at++ = static_cast<char>(bits | form); };
  if (n <= short_count_max) return begin(static_cast<unsigned>(n)), at;
  if (n <= 0xff) return begin(24), store_big_endian(at, static_cast<std::uint8_t>(n));
  if (n <= 0xffff) return begin(25), store_big_endian(at, static_cast<std::uint16_t>(n));
  if (n <= 0xffff'ffff) return begin(26), store_big_endian(at, static_cast<std::uint32_t>(n));
  return begin(27), store_big_endian(at, n);
}

inline char* write_signed(char* at, std::int64_t x) noexcept {
  return x < 0 ? write_head(at, major::negative, ~static_cast<std::uint64_t>(x))
               : write_head(at, major::whole, static_cast<std::uint64_t>(x));
}

// Every number, and the infinities and NaN as well.
inline char* write_double(char* at, double x) noexcept {
  *at = '\xfb';
  return store_big_endian(at + 1, std::bit_cast<std::uint64_t>(x));
}
inline char* write_float(char* at, float x) noexcept {
  *at = '\xfa';
  return store_big_endian(at + 1, std::bit_cast<std::uint32_t>(x));
}

// Writes a validated JSON text as CBOR. An integer that 64 bits hold is one; another number is a float of 32
// bits if that is exact, else the nearest of 64. Arrays are plain arrays, since a text does not say what its
// numbers are. Takes time in proportion to the text; a number may become 2.25 times as long. What nests
// deeper than depth_max overflows the writer.
inline constexpr std::size_t depth_max = 1024;
void write_json(std::string_view validated, writer& into) noexcept;

} // namespace cbor
} // namespace rowe::json
