// SPDX-License-Identifier: Apache-2.0
// Numbers to text. Doubles and floats get the shortest digits that read back to the same value; dragonbox
// (Jeon, "Dragonbox: A New Floating-Point Binary-to-Decimal Conversion Algorithm", 2020) finds them, the
// layout is ours:
//
//   0  1  -2  1000000      integers without a point, below 2^53 (float: 2^24), where every integer is exact
//   -0.0                   keeps its sign, which -0 would lose in readers that take it for an integer
//   0.000001  12.75        plain down to 1e-6
//   1e-7  1.5e300  1e16    otherwise with an exponent; so no integer text is longer than 16 digits, and none
//                          is beyond 64 bits, which some parsers refuse
//
// Every function takes the address to write to and returns the address behind the text. It may overwrite
// `number_buffer_bytes` there, because stores of fixed size make it fast. Nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>

#include <rowe/rt/attributes.hpp>

namespace rowe::json {

inline constexpr std::size_t number_buffer_bytes = 40;    // what a call may touch
inline constexpr std::size_t double_text_bytes_max = 25;  // -0.0000012345678901234567
inline constexpr std::size_t float_text_bytes_max = 17;   // -0.00000123456789
inline constexpr std::size_t integer_text_bytes_max = 20; // -9223372036854775808, 18446744073709551615
inline constexpr int decimals_max = 9;

// Null if `x` is not finite, because JSON has no text for it; the bytes written then mean nothing.
ROWE_RT char* write_double(char* at, double x) noexcept;
ROWE_RT char* write_float(char* at, float x) noexcept;

// Writes x rounded to `decimals` (0 to decimals_max) digits behind the point, without trailing zeros; what
// rounds to zero is 0. If |x| x 10^decimals reaches 2^53, the text is that of write_double. `x` must be
// finite.
ROWE_RT char* write_fixed(char* at, double x, int decimals) noexcept;

inline constexpr char hex_digits[] = "0123456789abcdef";
// Writes all 64 bits as 16 hexadecimal digits, and touches no more.
inline constexpr std::size_t hex_text_bytes = 16;
constexpr char* write_hex(char* at, std::uint64_t x) noexcept {
  for (int shift = 60; shift >= 0; shift -= 4) *at++ = hex_digits[x >> shift & 15U];
  return at;
}

ROWE_RT char* write_unsigned(char* at, std::uint64_t x) noexcept;
ROWE_RT char* write_signed(char* at, std::int64_t x) noexcept;

// Writes a count of 10^-decimals seconds in seconds, exactly: with the digits behind the point up to the last
// that is not 0. `decimals` is 0 to decimals_max. Not signed: the count has 64 bits without a sign.
ROWE_RT char* write_seconds(char* at, std::int64_t count, bool is_signed, int decimals) noexcept;

} // namespace rowe::json
