// SPDX-License-Identifier: Apache-2.0
// Text to numbers, for members of known types. A number's text is taken apart in one pass. Most become a
// double by one exact multiplication or division (Clinger, "How to Read Floating Point Numbers Accurately",
// 1990: both operands are exact, so the result is rounded once). The standard library reads the others.
// Integers are exact to the last digit, however they are written. The code for common numbers is inline here.
// Pure functions, on any thread; nothing waits or allocates; steps in proportion to the text.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "json/text/bytes.hpp"
#include "json/text/characters.hpp"

namespace rowe::json {

// significand x 10^exponent, with a sign.
struct decimal {
  const char* begin = nullptr;
  const char* end = nullptr; // of its text
  std::uint64_t significand = 0;
  std::int64_t exponent = 0;
  bool negative = false;
  bool exact = false; // the significand holds all digits; else only the text says what the number is

  std::string_view text() const noexcept { return {begin, static_cast<std::size_t>(end - begin)}; }
};

// Reads the number that begins at `at`, which is before `end`. Its text ends where no number continues. If
// the text is no valid number, it is still not empty, and does not go beyond `end`.
decimal read_decimal(const char* at, const char* end) noexcept;

// The nearest one, zeros with their sign. False, and nothing written, if the number is beyond the largest.
// (No double of a valid text is. A std::optional would go through memory and cost more than all the rest.)
bool to_real(const decimal& d, double& into) noexcept;
bool to_real(const decimal& d, float& into) noexcept;
// The nearest double of a number token (RFC 8259 grammar). A number that is too small is a zero with the
// token's sign. Nothing if it is beyond the largest double, or is no such token.
std::optional<double> nearest_double(std::string_view token) noexcept;

// An integer, or why there is none.
struct whole_number {
  enum class form : std::uint8_t { whole, fraction, too_large };
  form what = form::whole;
  bool negative = false;
  std::uint64_t magnitude = 0;
};

// 3, 3.0, 30e-1 and 0.3e1 are the same. too_large: the magnitude is beyond 64 bits.
whole_number to_whole(const decimal& d) noexcept;
// How many units of 10^-decimals the number is, rounded; half a unit away from 0. Never a fraction.
whole_number to_units(const decimal& d, int decimals) noexcept;
// Reads an integer that is written as a string: the text between the quotes, still escaped. It must be an
// integer in JSON, without fraction and exponent; else nothing.
std::optional<whole_number> read_quoted_whole(std::string_view escaped) noexcept;

// ---- common numbers ----

namespace detail {

inline constexpr std::size_t exact_digits_max = 19; // 10^19 is below 2^64

inline std::uint64_t digit(char c) noexcept { return static_cast<std::uint64_t>(c - '0'); }

// Are all eight bytes digits? Those are 0x30 to 0x39: the high half is 3, and stays 3 when 6 is added.
inline bool are_digits(std::uint64_t word) noexcept {
  constexpr std::uint64_t high_halves = each_byte * 0xf0;
  return ((word & high_halves) == each_byte * '0') &&
         (((word + each_byte * 6) & high_halves) == each_byte * '0');
}

// The value of eight digits. Neighbours are added up, the left one with its weight: first to four numbers
// below 100, then to two below 10^4, then to one.
inline std::uint64_t eight_digits(std::uint64_t word) noexcept {
  word -= each_byte * '0';
  word = ((word * (10 << 8 | 1)) >> 8) & 0x00ff'00ff'00ff'00ff;
  word = ((word * (100 << 16 | 1)) >> 16) & 0x0000'ffff'0000'ffff;
  return (word * (std::uint64_t{10'000} << 32 | 1)) >> 32;
}

// Appends the digits from `at` on to `significand`, which wraps around when they are too many.
inline const char* take_digits(const char* at, const char* end, std::uint64_t& significand) noexcept {
  std::uint64_t x = significand;
  while (end - at >= 8 && are_digits(load_eight(at))) {
    x = x * 100'000'000 + eight_digits(load_eight(at));
    at += 8;
  }
  for (; at != end && is_digit(*at); ++at) x = x * 10 + digit(*at);
  significand = x;
  return at;
}

// Behind an `e`: adds the exponent to the decimal's.
const char* take_exponent(const char* at, const char* end, std::int64_t& exponent) noexcept;

// A mantissa's text has more digits than the significand holds. Does it fit without its leading zeros?
bool fits_without_zeros(std::string_view mantissa, std::size_t digits) noexcept;

bool to_double_by_text(const decimal& d, double& into) noexcept;
whole_number to_whole_by_text(const decimal& d) noexcept;

inline constexpr std::array<double, 23> exact_powers_of_ten{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                            1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                            1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

} // namespace detail

inline decimal read_decimal(const char* at, const char* end) noexcept {
  decimal d;
  d.begin = at;
  d.negative = *at == '-';
  at += d.negative;
  const char* const mantissa = at;
  at = detail::take_digits(at, end, d.significand);
  auto digits = static_cast<std::size_t>(at - mantissa);
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    at = detail::take_digits(at, end, d.significand);
    d.exponent = fraction - at;
    digits += static_cast<std::size_t>(at - fraction);
  }
  d.exact = true;
  if (digits > detail::exact_digits_max) [[unlikely]] {
    d.exact = detail::fits_without_zeros({mantissa, static_cast<std::size_t>(at - mantissa)}, digits);
  }
  if (at != end && (*at == 'e' || *at == 'E')) at = detail::take_exponent(at + 1, end, d.exponent);
  d.end = at == d.begin ? at + 1 : at;
  return d;
}

inline bool to_real(const decimal& d, double& into) noexcept {
  constexpr std::uint64_t exact_limit = std::uint64_t{1} << std::numeric_limits<double>::digits;
  constexpr auto exponent_max = static_cast<std::int64_t>(detail::exact_powers_of_ten.size()) - 1;
  if (!d.exact || d.significand > exact_limit || d.exponent < -exponent_max || d.exponent > exponent_max) {
    return detail::to_double_by_text(d, into);
  }
  auto x = static_cast<double>(d.significand);
  if (d.exponent < 0) {
    x /= detail::exact_powers_of_ten[static_cast<std::size_t>(-d.exponent)];
  } else if (d.exponent > 0) {
    x *= detail::exact_powers_of_ten[static_cast<std::size_t>(d.exponent)];
  }
  into = d.negative ? -x : x;
  return true;
}

inline whole_number to_whole(const decimal& d) noexcept {
  if (!d.exact || d.exponent != 0) [[unlikely]]
    return detail::to_whole_by_text(d);
  return {.what = whole_number::form::whole, .negative = d.negative, .magnitude = d.significand};
}

} // namespace rowe::json
