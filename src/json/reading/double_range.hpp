// SPDX-License-Identifier: Apache-2.0
// Is a number within the range of a double? Decided digit by digit, for a number that comes in pieces and may
// be longer than any buffer. A number is beyond the range if it would round to more than the largest double.
// So it is compared with the middle between that and the next power of two: 2^1024 - 2^970, an integer of 309
// digits. One thread; never waits, never allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace rowe::json {

namespace detail {

inline constexpr std::size_t double_limit_digits = 309;

// The digits of 2^1024 - 2^970 = (2^54 - 1) * 2^970, the first one first.
consteval std::array<char, double_limit_digits> digits_of_double_limit() {
  std::array<char, double_limit_digits> digits{};
  std::uint64_t first = (std::uint64_t{1} << 54) - 1;
  for (std::size_t i = double_limit_digits; i-- > 0; first /= 10) {
    digits[i] = static_cast<char>(first % 10);
  }
  for (int power = 0; power < 970; power += 10) {
    int carry = 0;
    for (std::size_t i = double_limit_digits; i-- > 0;) {
      const int product = digits[i] * 1024 + carry;
      digits[i] = static_cast<char>(product % 10);
      carry = product / 10;
    }
  }
  return digits;
}

inline constexpr auto double_limit = digits_of_double_limit();
static_assert(double_limit[0] == 1 && double_limit[1] == 7 && double_limit[308] == 2);

} // namespace detail

// Takes the digits of one number, in their order: those of the integer part, those of the fraction, those of
// the exponent.
class double_range {
 public:
  void integer_digit(char c) noexcept {
    if (!significant_ && c == '0') return;
    ++scale_;
    compare(c);
  }
  void fraction_digit(char c) noexcept {
    if (!significant_ && c == '0') {
      --scale_;
    } else {
      compare(c);
    }
  }
  // Digits whose values no longer matter: comparing() is false.
  void integer_digits(std::size_t count) noexcept { scale_ += static_cast<std::int64_t>(count); }

  // Do the digits that follow matter, other than by their number?
  bool comparing() const noexcept { return !significant_ || order_ == order::equal; }

  void exponent_sign(char c) noexcept { exponent_negative_ = c == '-'; }
  void exponent_digit(char c) noexcept {
    // No text has enough digits to compensate for a larger exponent, so this one represents all of them.
    constexpr std::int64_t exponent_max = std::int64_t{1} << 48;
    exponent_ = exponent_ * 10 + (c - '0');
    if (exponent_ > exponent_max) exponent_ = exponent_max;
  }

  // Of the number so far: is its magnitude too large for a double?
  bool exceeded() const noexcept {
    if (!significant_) return false;
    const std::int64_t scale = scale_ + (exponent_negative_ ? -exponent_ : exponent_);
    constexpr auto digits = static_cast<std::int64_t>(detail::double_limit_digits);
    if (scale != digits) return scale > digits;
    // The digits that were not written are zeros, and the limit does not end with one.
    return order_ == order::more || (order_ == order::equal && compared_ >= detail::double_limit_digits);
  }

 private:
  enum class order : std::uint8_t { equal, less, more }; // of the digits so far, compared with the limit's

  void compare(char c) noexcept {
    significant_ = true;
    if (order_ != order::equal) return;
    const char limit = compared_ < detail::double_limit_digits ? detail::double_limit[compared_] : char{0};
    ++compared_;
    const auto digit = static_cast<char>(c - '0');
    if (digit != limit) order_ = digit < limit ? order::less : order::more;
  }

  std::int64_t scale_ = 0; // the number is 0.D * 10^scale, where D begins with the first digit that is not 0
  std::int64_t exponent_ = 0;
  std::size_t compared_ = 0;
  order order_ = order::equal;
  bool significant_ = false; // a digit other than 0 has come
  bool exponent_negative_ = false;
};

} // namespace rowe::json
