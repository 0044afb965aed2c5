// SPDX-License-Identifier: Apache-2.0
#include "numbers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>

#include "bytes.hpp"
#include "cursor.hpp"
#include "fault.hpp"

namespace rowe::json {
namespace {

constexpr std::size_t exact_digits_max = 19;               // 10^19 is below 2^64
constexpr std::int64_t exponent_limit = 1'000'000'000'000; // beyond any text's number of digits

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
std::uint64_t digit(char c) noexcept { return static_cast<std::uint64_t>(c - '0'); }

// Are all eight bytes digits? Those are 0x30 to 0x39: the high half is 3, and stays 3 when 6 is added.
bool are_digits(std::uint64_t word) noexcept {
  constexpr std::uint64_t high_halves = each_byte * 0xf0;
  return ((word & high_halves) == each_byte * '0') &&
         (((word + each_byte * 6) & high_halves) == each_byte * '0');
}

// What eight digits say. Neighbours are added up, the left one with its weight: to four numbers below 100, to
// two below 10^4, to one.
std::uint64_t eight_digits(std::uint64_t word) noexcept {
  word -= each_byte * '0';
  word = ((word * (10 << 8 | 1)) >> 8) & 0x00ff'00ff'00ff'00ff;
  word = ((word * (100 << 16 | 1)) >> 16) & 0x0000'ffff'0000'ffff;
  return (word * (std::uint64_t{10'000} << 32 | 1)) >> 32;
}

// Appends the digits from `at` on to `significand`, which wraps around when they are too many.
const char* take_digits(const char* at, const char* end, std::uint64_t& significand) noexcept {
  while (end - at >= 8 && are_digits(load_eight(at))) {
    significand = significand * 100'000'000 + eight_digits(load_eight(at));
    at += 8;
  }
  for (; at != end && is_digit(*at); ++at) significand = significand * 10 + digit(*at);
  return at;
}

// Behind an `e`; the exponent, cut to exponent_limit.
const char* take_exponent(const char* at, const char* end, std::int64_t& exponent) noexcept {
  const bool negative = at != end && *at == '-';
  if (at != end && (*at == '-' || *at == '+')) ++at;
  std::int64_t x = 0;
  for (; at != end && is_digit(*at); ++at) {
    x = std::min(x * 10 + static_cast<std::int64_t>(digit(*at)), exponent_limit);
  }
  exponent = negative ? -x : x;
  return at;
}

// Of a mantissa's text, point included.
std::size_t leading_zeros(std::string_view mantissa) noexcept {
  std::size_t zeros = 0;
  for (const char c : mantissa) {
    if (c == '0') {
      ++zeros;
    } else if (c != '.') {
      break;
    }
  }
  return zeros;
}

// The digits of `mantissa` times 10^exponent, whatever their number.
whole_number whole_from_digits(std::string_view mantissa, std::int64_t exponent, bool negative) noexcept {
  using verdict = whole_number::verdict;
  // Zeros at the end are taken off, so that a negative exponent is a fraction.
  while (!mantissa.empty() && (mantissa.back() == '0' || mantissa.back() == '.')) {
    exponent += mantissa.back() == '0';
    mantissa.remove_suffix(1);
  }
  if (mantissa.empty()) return {.negative = negative};
  if (exponent < 0) return {.what = verdict::fraction};
  if (exponent > static_cast<std::int64_t>(exact_digits_max)) return {.what = verdict::too_large};
  std::uint64_t x = 0;
  bool overflow = false;
  for (const char c : mantissa) {
    if (c == '.') continue;
    overflow |= __builtin_mul_overflow(x, std::uint64_t{10}, &x) || __builtin_add_overflow(x, digit(c), &x);
  }
  for (; exponent > 0; --exponent) overflow |= __builtin_mul_overflow(x, std::uint64_t{10}, &x);
  if (overflow) return {.what = verdict::too_large};
  return {.negative = negative, .magnitude = x};
}

// Without sign, from the first digit to the last one before the exponent.
std::string_view mantissa_of(const decimal& d) noexcept {
  const std::string_view text = d.text.substr(d.negative);
  return text.substr(0, text.find_first_of("eE"));
}

constexpr std::array<double, 23> exact_powers_of_ten{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

// Could rounding `x`, which was rounded to a double, once more to a float give another float than rounding
// the number itself? Only when x lies in the middle of two floats, or where floats are denser or end.
bool rounds_twice(double x) noexcept {
  constexpr std::uint64_t dropped_bits =
      (1U << (std::numeric_limits<double>::digits - std::numeric_limits<float>::digits)) - 1;
  if ((std::bit_cast<std::uint64_t>(x) & dropped_bits) == dropped_bits / 2 + 1) return true;
  const double size = std::fabs(x);
  return size > static_cast<double>(std::numeric_limits<float>::max()) ||
         (size < static_cast<double>(std::numeric_limits<float>::min()) && size != 0);
}

} // namespace

decimal read_decimal(const char* at, const char* end) noexcept {
  decimal d;
  const char* const begin = at;
  d.negative = *at == '-';
  at += d.negative;
  const char* const mantissa = at;
  at = take_digits(at, end, d.significand);
  auto digits = static_cast<std::size_t>(at - mantissa);
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    at = take_digits(at, end, d.significand);
    d.exponent = fraction - at;
    digits += static_cast<std::size_t>(at - fraction);
  }
  d.exact = digits <= exact_digits_max || digits - leading_zeros(between(mantissa, at)) <= exact_digits_max;
  if (at != end && (*at == 'e' || *at == 'E')) {
    std::int64_t written = 0;
    at = take_exponent(at + 1, end, written);
    d.exponent += written;
  }
  d.text = between(begin, at == begin ? begin + 1 : at);
  return d;
}

std::optional<double> to_double(const decimal& d) noexcept {
  constexpr std::uint64_t exact_limit = std::uint64_t{1} << std::numeric_limits<double>::digits;
  constexpr auto exponent_max = static_cast<std::int64_t>(exact_powers_of_ten.size()) - 1;
  if (!d.exact || d.significand > exact_limit || d.exponent < -exponent_max || d.exponent > exponent_max) {
    return nearest_double(d.text);
  }
  const auto significand = static_cast<double>(d.significand);
  const double x = d.exponent < 0 ? significand / exact_powers_of_ten[static_cast<std::size_t>(-d.exponent)]
                                  : significand * exact_powers_of_ten[static_cast<std::size_t>(d.exponent)];
  return d.negative ? -x : x;
}

std::optional<float> to_float(const decimal& d) noexcept {
  const std::optional<double> x = to_double(d);
  if (!x) return std::nullopt;
  if (!rounds_twice(*x)) [[likely]]
    return static_cast<float>(*x);
  float y = 0;
  const auto read = std::from_chars(d.text.data(), d.text.data() + d.text.size(), y);
  if (read.ec == std::errc{} && std::isfinite(y)) return y;
  // The standard leaves it open which way the range was left.
  if (std::fabs(*x) > 1) return std::nullopt;
  return d.negative ? -0.0F : 0.0F;
}

whole_number to_whole(const decimal& d) noexcept {
  if (d.exact && d.exponent == 0) [[likely]]
    return {.negative = d.negative, .magnitude = d.significand};
  const std::string_view mantissa = mantissa_of(d);
  // 10^exponent counts from the last digit, as d.exponent does.
  return whole_from_digits(mantissa, d.exponent, d.negative);
}

std::optional<whole_number> read_quoted_whole(std::string_view escaped) noexcept {
  whole_number n;
  std::size_t characters = 0; // behind the sign
  bool leading_zero = false;
  const char* at = escaped.data();
  const char* const end = at + escaped.size();
  while (at != end) {
    std::array<char, 4> character{*at};
    const std::size_t bytes = *at == '\\' ? take_escape(at, end, character) : (++at, 1);
    const char c = character[0];
    if (bytes == 1 && c == '-' && characters == 0 && !n.negative) {
      n.negative = true;
      continue;
    }
    if (bytes != 1 || !is_digit(c) || leading_zero) return std::nullopt;
    leading_zero = c == '0' && characters == 0;
    ++characters;
    if (__builtin_mul_overflow(n.magnitude, std::uint64_t{10}, &n.magnitude) ||
        __builtin_add_overflow(n.magnitude, digit(c), &n.magnitude)) {
      n.what = whole_number::verdict::too_large;
    }
  }
  if (characters == 0) return std::nullopt;
  return n;
}

} // namespace rowe::json
