// SPDX-License-Identifier: Apache-2.0
// Digits are written left to right, two at a time from a table or sixteen at once. Where possible, the number
// of stores does not depend on the value, because formatting spends most of its time on branches that depend
// on random digits. So the most frequent doubles of robots have their own function, which uses dragonbox's
// proof and powers of ten, but not its branches and its loop. Dragonbox formats all others. Pure functions,
// on any thread.
#include "json/text/digits.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include <dragonbox/dragonbox.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace rowe::json {
namespace {

constexpr std::uint32_t ten_to_4 = 10'000;
constexpr std::uint32_t ten_to_8 = 100'000'000;
constexpr std::uint64_t ten_to_16 = std::uint64_t{ten_to_8} * ten_to_8;

// "00" to "99".
constexpr std::array<char, 200> pairs = [] {
  std::array<char, 200> text{};
  for (std::size_t i = 0; i < 100; ++i) {
    text[2 * i] = static_cast<char>('0' + i / 10);
    text[2 * i + 1] = static_cast<char>('0' + i % 10);
  }
  return text;
}();

constexpr std::array<std::uint64_t, 20> powers_of_ten = [] {
  std::array<std::uint64_t, 20> powers{};
  std::uint64_t power = 1;
  for (std::uint64_t& p : powers) {
    p = power;
    power *= 10;
  }
  return powers;
}();

std::uint64_t power_of_ten(int exponent) noexcept {
  assert(exponent >= 0 && exponent < 20);
  return powers_of_ten[static_cast<std::size_t>(exponent)];
}

// Exactly so many digits, zeros in front included.
void one_digit(char* at, std::uint32_t x) noexcept { *at = static_cast<char>('0' + x); }
void two_digits(char* at, std::uint32_t x) noexcept { std::memcpy(at, &pairs[2 * x], 2); }
void four_digits(char* at, std::uint32_t x) noexcept {
  two_digits(at, x / 100);
  two_digits(at + 2, x % 100);
}
void eight_digits(char* at, std::uint32_t x) noexcept {
  four_digits(at, x / ten_to_4);
  four_digits(at + 4, x % ten_to_4);
}

// As many digits as the number has.
char* write_below_ten_to_4(char* at, std::uint32_t x) noexcept {
  if (x < 10) {
    one_digit(at, x);
    return at + 1;
  }
  if (x < 100) {
    two_digits(at, x);
    return at + 2;
  }
  if (x < 1000) {
    two_digits(at, x / 10);
    one_digit(at + 2, x % 10);
    return at + 3;
  }
  four_digits(at, x);
  return at + 4;
}

char* write_below_ten_to_8(char* at, std::uint32_t x) noexcept {
  if (x < ten_to_4) return write_below_ten_to_4(at, x);
  at = write_below_ten_to_4(at, x / ten_to_4);
  four_digits(at, x % ten_to_4);
  return at + 4;
}

// Writes sixteen digits, eight of each number. Returns a mask of the digits that are not 0; the first digit
// has the lowest bit.
[[maybe_unused]] std::uint32_t sixteen_digits_portably(char* at, std::uint32_t high,
                                                       std::uint32_t low) noexcept {
  eight_digits(at, high);
  eight_digits(at + 8, low);
  std::uint32_t not_zero = 0;
  for (int i = 0; i < 16; ++i) not_zero |= std::uint32_t{at[i] != '0'} << i;
  return not_zero;
}

#if defined(__SSE2__) // every x86-64; a sixth of the whole time
// Splits three times, in all lanes at once: eight digits into fours, twos and ones. The multiplications by
// 2^45 / 10^4, 2^19 / 100 and 2^16 / 10, rounded up, are divisions that are exact for such small operands.
std::uint32_t sixteen_digits(char* at, std::uint32_t high, std::uint32_t low) noexcept {
  const auto lanes = [](std::uint32_t x) { return _mm_set1_epi32(static_cast<int>(x)); };
  const __m128i eights =
      _mm_unpacklo_epi64(_mm_cvtsi32_si128(static_cast<int>(high)), _mm_cvtsi32_si128(static_cast<int>(low)));
  const __m128i fours_high = _mm_srli_epi64(_mm_mul_epu32(eights, lanes(3'518'437'209)), 45);
  const __m128i fours_low = _mm_sub_epi32(eights, _mm_mul_epu32(fours_high, lanes(ten_to_4)));
  const __m128i fours = _mm_or_si128(fours_high, _mm_slli_epi64(fours_low, 32));
  const __m128i twos_high = _mm_srli_epi16(_mm_mulhi_epu16(fours, lanes(5243)), 3);
  const __m128i twos_low = _mm_sub_epi16(fours, _mm_mullo_epi16(twos_high, lanes(100)));
  const __m128i twos = _mm_or_si128(twos_high, _mm_slli_epi32(twos_low, 16));
  const __m128i ones_high = _mm_mulhi_epu16(twos, _mm_set1_epi16(6554));
  const __m128i ones_low = _mm_sub_epi16(twos, _mm_mullo_epi16(ones_high, _mm_set1_epi16(10)));
  const __m128i ones = _mm_or_si128(ones_high, _mm_slli_epi16(ones_low, 8));
  const __m128i text = _mm_or_si128(ones, _mm_set1_epi8('0'));
  std::memcpy(at, &text, sizeof text);
  const auto not_zero =
      static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_cmpgt_epi8(ones, _mm_setzero_si128())));
#ifndef NDEBUG
  char expected[16];
  assert(sixteen_digits_portably(expected, high, low) == not_zero);
  assert(std::memcmp(at, expected, sizeof expected) == 0);
#endif
  return not_zero;
}
#else
std::uint32_t sixteen_digits(char* at, std::uint32_t high, std::uint32_t low) noexcept {
  return sixteen_digits_portably(at, high, low);
}
#endif

// Writes x < 10^17 as 17 digits. Returns how many there are without the zeros at the end, but at least one.
int seventeen_digits(char* at, std::uint64_t x) noexcept {
  const std::uint64_t rest = x % ten_to_16;
  one_digit(at, static_cast<std::uint32_t>(x / ten_to_16));
  const std::uint32_t not_zero = sixteen_digits(at + 1, static_cast<std::uint32_t>(rest / ten_to_8),
                                                static_cast<std::uint32_t>(rest % ten_to_8));
  return static_cast<int>(std::bit_width(not_zero << 1 | 1));
}

int digit_count(std::uint64_t x) noexcept {
  assert(x != 0);
  // 1233 / 4096 is a little more than log10(2); the comparison corrects the guess.
  const int guess = (static_cast<int>(std::bit_width(x)) * 1233) >> 12;
  return guess + (x >= power_of_ten(guess));
}

// A decimal number: digits x 10^exponent.
struct shortest_digits {
  std::uint64_t digits; // not 0, the last one not 0 either; at most 17
  int exponent;
};

template <class Real>
shortest_digits shortest(Real x) noexcept {
  namespace dragonbox = jkj::dragonbox;
  const auto d =
      dragonbox::to_decimal(x, dragonbox::policy::sign::ignore, dragonbox::policy::trailing_zero::remove);
  return {d.significand, d.exponent};
}

// Writes `whole`.`fraction`: the decimal d, whose integer part is known. d.exponent is in [-22, -1].
char* write_plain(char* at, std::uint64_t whole, shortest_digits d) noexcept {
  // Up to 17 digits behind the point are written. If there are more, the first ones are zeros, because d has
  // at most 17 digits and `whole` is 0 then.
  const int fraction_digits = -d.exponent;
  const int zeros = std::max(fraction_digits - 17, 0);
  const int count = fraction_digits - zeros;
  const std::uint64_t fraction = d.digits - whole * power_of_ten(count);
  at = write_unsigned(at, whole);
  std::memcpy(at, ".000000", 8);
  at += 1 + zeros;
  seventeen_digits(at, fraction * power_of_ten(17 - count));
  return at + count;
}

char* write_with_exponent(char* at, shortest_digits d) noexcept {
  const int count = digit_count(d.digits);
  const int exponent = d.exponent + count - 1;
  seventeen_digits(at + 1, d.digits * power_of_ten(17 - count));
  at[0] = at[1];
  if (count > 1) {
    at[1] = '.';
    ++at;
  }
  at += count;
  *at++ = 'e';
  *at = '-';
  at += exponent < 0;
  return write_below_ten_to_4(at, static_cast<std::uint32_t>(std::abs(exponent)));
}

// `integers_end`: the end of the integers that are all exact in a Real.
template <class Real>
char* write_real(char* at, Real x, Real integers_end) noexcept {
  *at = '-';
  at += std::signbit(x);
  const Real magnitude = std::fabs(x);
  if (magnitude < integers_end) {
    const auto whole = static_cast<std::int64_t>(magnitude);
    if (static_cast<Real>(whole) == magnitude) {
      at = write_unsigned(at, static_cast<std::uint64_t>(whole));
      if (whole != 0 || !std::signbit(x)) return at;
      std::memcpy(at, ".0", 2);
      return at + 2;
    }
    // The integer part of the shortest decimal is that of x: an integer between the two would be exact, and
    // nearer to the decimal than x is.
    if (magnitude >= Real(1e-6))
      return write_plain(at, static_cast<std::uint64_t>(whole), shortest(magnitude));
  }
  if (!(magnitude <= std::numeric_limits<Real>::max())) return nullptr;
  return write_with_exponent(at, shortest(magnitude));
}

[[gnu::noinline]] char* write_any_double(char* at, double x) noexcept { return write_real(at, x, 0x1p53); }

// ---- common doubles ----

constexpr int mantissa_bits = std::numeric_limits<double>::digits - 1;
constexpr std::uint64_t hidden_bit = std::uint64_t{1} << mantissa_bits;
constexpr int exponent_bias = 1023;
constexpr int everyday_begin = -19; // binary exponents: numbers from 0.0000019
constexpr int everyday_end = 26;    // to 67 millions

// What the doubles of one binary exponent, and their shortest decimals, have in common.
struct alignas(64) magnitude {
  std::uint64_t power_high, power_low; // of ten: makes the interval of what rounds to x `delta` wide
  std::uint64_t one;                   // in units of the last digit; 0 where x is below it
  std::uint64_t fill;                  // a fraction in those units times this has 17 digits
  std::uint32_t delta;                 // 100 to 999
  std::int32_t shift;
  std::int64_t zeros; // behind the point, before the 17 digits
};

constexpr auto magnitudes = [] {
  std::array<magnitude, everyday_end - everyday_begin> all{};
  for (int e = everyday_begin; e < everyday_end; ++e) {
    const int exponent = e - mantissa_bits;
    // floor(log10(2^exponent)) and floor(log2(10^power)), exact for the exponents of doubles.
    const int power = 2 - ((exponent * 315'653) >> 20);
    const int shift = exponent + ((power * 1'741'647) >> 19);
    const int digits = power - 2; // behind the point
    const auto ten = jkj::dragonbox::policy::cache::full.get_cache<jkj::dragonbox::ieee754_binary64>(power);
    all[static_cast<std::size_t>(e - everyday_begin)] = {
        .power_high = ten.high(),
        .power_low = ten.low(),
        .one = e < 0 ? 0 : powers_of_ten[static_cast<std::size_t>(digits)],
        .fill = powers_of_ten[static_cast<std::size_t>(std::max(17 - digits, 0))],
        .delta = static_cast<std::uint32_t>(ten.high() >> (63 - shift)),
        .shift = shift,
        .zeros = std::max(digits - 17, 0)};
  }
  return all;
}();

} // namespace

// Dragonbox (section 5 of the paper; its names are z, delta and kappa = 2). Take the interval of all numbers
// that round to x. Its upper end is multiplied by a power of ten. If a multiple of 1000 lies in the interval,
// that is the shortest decimal; else it is the multiple of 100 nearest to x. Which of the two is as random as
// the digits, so it is selected without a branch, and zeros at the end are cut off in the text. In one case
// of a hundred the dropped fractions decide; then, and next to a power of two, dragonbox itself does it
// again.
[[gnu::flatten]] char* write_double(char* const at, const double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  if (bits == 0) {
    *at = '0';
    return at + 1;
  }
  const std::uint64_t mantissa = bits & (hidden_bit - 1);
  const std::uint64_t index = (bits >> mantissa_bits & 0x7ff) - (exponent_bias + everyday_begin);
  if (index >= magnitudes.size() || mantissa == 0) return write_any_double(at, x);
  const auto whole = static_cast<std::int32_t>(std::fabs(x));
  if (static_cast<double>(whole) == std::fabs(x)) return write_any_double(at, x);

  namespace wide = jkj::dragonbox::detail::wuint;
  const magnitude& m = magnitudes[index];
  const std::uint64_t upper_end = (2 * (mantissa | hidden_bit) + 1) << m.shift;
  const std::uint64_t z = wide::umul192_upper128(upper_end, {m.power_high, m.power_low}).high();
  const std::uint64_t thousands = wide::umul128_upper64(z, 2'361'183'241'434'822'607) >> 7;
  const auto rest = static_cast<std::uint32_t>(z) - static_cast<std::uint32_t>(thousands) * 1000;
  // By 2^16: a division by 100 that is exact up to 1000.
  const std::uint32_t hundreds = (rest - m.delta / 2 + 50) * 656;
  const std::uint32_t outside = 0 - std::uint32_t{rest > m.delta}; // a mask: no multiple of 1000
  if (rest == 0 || rest == m.delta || (hundreds & 0xffff & outside) < (656 & outside)) [[unlikely]]
    return write_any_double(at, x);
  const std::uint64_t digits = thousands * 10 + (hundreds >> 16 & outside);

  *at = '-';
  char* to = write_below_ten_to_8(at + (bits >> 63), static_cast<std::uint32_t>(whole));
  std::memcpy(to, ".000000", 8);
  to += 1 + m.zeros;
  return to + seventeen_digits(to, (digits - static_cast<std::uint64_t>(whole) * m.one) * m.fill);
}

char* write_float(char* at, float x) noexcept { return write_real(at, x, 0x1p24f); }

char* write_unsigned(char* at, std::uint64_t x) noexcept {
  if (x < ten_to_8) return write_below_ten_to_8(at, static_cast<std::uint32_t>(x));
  if (x < ten_to_16) {
    at = write_below_ten_to_8(at, static_cast<std::uint32_t>(x / ten_to_8));
    eight_digits(at, static_cast<std::uint32_t>(x % ten_to_8));
    return at + 8;
  }
  at = write_below_ten_to_4(at, static_cast<std::uint32_t>(x / ten_to_16));
  eight_digits(at, static_cast<std::uint32_t>(x % ten_to_16 / ten_to_8));
  eight_digits(at + 8, static_cast<std::uint32_t>(x % ten_to_8));
  return at + 16;
}

char* write_signed(char* at, std::int64_t x) noexcept {
  *at = '-';
  at += x < 0;
  const auto bits = static_cast<std::uint64_t>(x);
  return write_unsigned(at, x < 0 ? 0 - bits : bits);
}

char* write_fixed(char* at, double x, int decimals) noexcept {
  assert(decimals >= 0 && decimals <= decimals_max);
  const std::uint64_t power = power_of_ten(decimals);
  const double scaled = std::fabs(x) * static_cast<double>(power);
  if (!(scaled < 0x1p53)) return write_double(at, x); // no number at all, too
  const auto units = static_cast<std::uint64_t>(scaled + 0.5);
  *at = '-';
  at += std::signbit(x) && units != 0;
  at = write_unsigned(at, units / power);
  std::uint64_t fraction = units % power;
  if (fraction == 0) return at;
  for (; fraction % 10 == 0; fraction /= 10) --decimals;
  *at++ = '.';
  seventeen_digits(at, fraction * power_of_ten(17 - decimals));
  return at + decimals;
}

char* write_seconds(char* at, std::int64_t count, bool is_signed, int decimals) noexcept {
  auto units = static_cast<std::uint64_t>(count);
  if (count < 0 && is_signed) {
    *at++ = '-';
    units = 0 - units;
  }
  std::uint64_t second = 1;
  for (int i = 0; i < decimals; ++i) second *= 10;
  at = write_unsigned(at, units / second);
  std::uint64_t rest = units % second;
  if (rest == 0) return at;
  *at++ = '.';
  for (; rest != 0; rest %= second) {
    second /= 10;
    *at++ = static_cast<char>('0' + rest / second);
  }
  return at;
}

} // namespace rowe::json
