// SPDX-License-Identifier: Apache-2.0
// Text to numbers, where they are read into members of known types. A number's text is taken apart once, in
// one pass; most become a double by one exact multiplication or division (Clinger, "How to Read Floating
// Point Numbers Accurately", 1990: both operands are exact, so the result is rounded once), the others are
// left to the standard library. Integers are exact to the last digit, however they are written. Pure
// functions, on any thread; nothing waits or allocates; steps in proportion to the text.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace rowe::json {

// significand x 10^exponent, with a sign.
struct decimal {
  std::string_view text; // all of it
  std::uint64_t significand = 0;
  std::int64_t exponent = 0;
  bool negative = false;
  bool exact = false; // the significand holds all digits; else only `text` says what the number is
};

// The number that begins at `at`, which is before `end`. `text` ends where no number goes on; on text that is
// no valid number it is never empty and never goes beyond `end`.
decimal read_decimal(const char* at, const char* end) noexcept;

// The nearest one, zeros with their sign; nothing when the number is beyond the largest. (No double of a
// valid text is.)
std::optional<double> to_double(const decimal& d) noexcept;
std::optional<float> to_float(const decimal& d) noexcept;

// An integer, or why there is none.
struct whole_number {
  enum class verdict : std::uint8_t { whole, fraction, too_large };
  verdict what = verdict::whole;
  bool negative = false;
  std::uint64_t magnitude = 0;
};

// 3, 3.0, 30e-1 and 0.3e1 are the same. too_large: the magnitude is beyond 64 bits.
whole_number to_whole(const decimal& d) noexcept;
// What stands in quotes when an integer is written as a string, still escaped: JSON's integers, no fraction,
// no exponent. Nothing when it is another text.
std::optional<whole_number> read_quoted_whole(std::string_view escaped) noexcept;

} // namespace rowe::json
