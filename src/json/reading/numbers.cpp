// SPDX-License-Identifier: Apache-2.0
#include "json/reading/numbers.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "json/reading/cursor.hpp"

namespace rowe::json {
namespace {

// The length of the leading zeros of a mantissa's text, with the point.
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

// The digits of `mantissa`, however many, times 10^exponent; the exponent is that of the last digit.
whole_number whole_from_digits(std::string_view mantissa, std::int64_t exponent, bool negative) noexcept {
  using form = whole_number::form;
  // Zeros at the end are removed, so a negative exponent means a fraction.
  while (!mantissa.empty() && (mantissa.back() == '0' || mantissa.back() == '.')) {
    exponent += mantissa.back() == '0';
    mantissa.remove_suffix(1);
  }
  whole_number n{.what = form::whole, .negative = negative, .magnitude = 0};
  if (mantissa.empty()) return n;
  if (exponent < 0) {
    n.what = form::fraction;
    return n;
  }
  bool overflow = exponent > static_cast<std::int64_t>(detail::exact_digits_max);
  const auto append = [&](std::uint64_t digit) {
    overflow |= __builtin_mul_overflow(n.magnitude, std::uint64_t{10}, &n.magnitude) ||
                __builtin_add_overflow(n.magnitude, digit, &n.magnitude);
  };
  for (const char c : mantissa) {
    if (c != '.') append(detail::digit(c));
  }
  for (; exponent > 0 && !overflow; --exponent) append(0);
  if (overflow) n.what = form::too_large;
  return n;
}

// `x` was rounded to a double. Could rounding it to a float give another float than rounding the number
// itself? Only if x is in the middle of two floats, or where floats become denser or end.
bool rounds_twice(double x) noexcept {
  constexpr int dropped = std::numeric_limits<double>::digits - std::numeric_limits<float>::digits;
  constexpr std::uint64_t dropped_bits = (std::uint64_t{1} << dropped) - 1;
  if ((std::bit_cast<std::uint64_t>(x) & dropped_bits) == dropped_bits / 2 + 1) return true;
  const double size = std::fabs(x);
  return size > static_cast<double>(std::numeric_limits<float>::max()) ||
         (size < static_cast<double>(std::numeric_limits<float>::min()) && size != 0);
}

// Is the number, which is no zero, 1 or more? By the power of ten of its first digit that is not 0.
bool is_large(std::string_view token) noexcept {
  const std::size_t mantissa = std::min(token.find_first_of("eE"), token.size());
  const std::size_t point = std::min(token.find('.'), mantissa);
  const std::size_t first = token.find_first_of("123456789");
  auto power = static_cast<std::int64_t>(point) - static_cast<std::int64_t>(first) - (first < point);
  if (mantissa < token.size()) {
    detail::take_exponent(token.data() + mantissa + 1, token.data() + token.size(), power);
  }
  return power >= 0;
}

} // namespace

namespace detail {

const char* take_exponent(const char* at, const char* end, std::int64_t& exponent) noexcept {
  constexpr std::int64_t limit = 1'000'000'000'000; // beyond any text's number of digits
  const bool negative = at != end && *at == '-';
  if (at != end && (*at == '-' || *at == '+')) ++at;
  std::int64_t x = 0;
  for (; at != end && is_digit(*at); ++at)
    x = std::min(x * 10 + static_cast<std::int64_t>(digit(*at)), limit);
  exponent += negative ? -x : x;
  return at;
}

bool fits_without_zeros(std::string_view mantissa, std::size_t digits) noexcept {
  return digits - leading_zeros(mantissa) <= exact_digits_max;
}

bool to_double_by_text(const decimal& d, double& into) noexcept {
  const std::optional<double> x = nearest_double(d.text());
  if (x) into = *x;
  return x.has_value();
}

whole_number to_whole_by_text(const decimal& d) noexcept {
  const std::string_view text = d.text().substr(d.negative);
  return whole_from_digits(text.substr(0, text.find_first_of("eE")), d.exponent, d.negative);
}

} // namespace detail

std::optional<double> nearest_double(std::string_view token) noexcept {
  double x = 0;
  const char* const end = token.data() + token.size();
  const auto read = std::from_chars(token.data(), end, x);
  if (read.ptr != end) return std::nullopt;
  if (read.ec == std::errc{}) return x;
  // The standard does not say whether the number was too large or too small.
  if (read.ec != std::errc::result_out_of_range || is_large(token)) return std::nullopt;
  return token.front() == '-' ? -0.0 : 0.0;
}

bool to_real(const decimal& d, float& into) noexcept {
  double x = 0;
  if (!to_real(d, x)) return false;
  if (!rounds_twice(x)) [[likely]] {
    into = static_cast<float>(x);
    return true;
  }
  float y = 0;
  const auto read = std::from_chars(d.begin, d.end, y);
  if (read.ec != std::errc{} || !std::isfinite(y)) {
    // The standard does not say whether the number was too large or too small.
    if (std::fabs(x) > 1) return false;
    y = d.negative ? -0.0F : 0.0F;
  }
  into = y;
  return true;
}

whole_number to_units(const decimal& d, int decimals) noexcept {
  std::string_view mantissa = d.text().substr(d.negative);
  mantissa = mantissa.substr(0, mantissa.find_first_of("eE"));
  std::int64_t exponent = d.exponent + decimals; // of the last digit
  bool up = false;
  for (; exponent < 0 && !mantissa.empty(); mantissa.remove_suffix(1)) {
    if (mantissa.back() == '.') continue;
    up = mantissa.back() >= '5';
    ++exponent;
  }
  if (exponent < 0) return {.what = whole_number::form::whole, .negative = d.negative, .magnitude = 0};
  whole_number n = whole_from_digits(mantissa, exponent, d.negative);
  if (__builtin_add_overflow(n.magnitude, std::uint64_t{up}, &n.magnitude)) {
    n.what = whole_number::form::too_large;
  }
  return n;
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
        __builtin_add_overflow(n.magnitude, detail::digit(c), &n.magnitude)) {
      n.what = whole_number::form::too_large;
    }
  }
  if (characters == 0) return std::nullopt;
  return n;
}

} // namespace rowe::json
