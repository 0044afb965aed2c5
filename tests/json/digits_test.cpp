// SPDX-License-Identifier: Apache-2.0
#include "json/text/digits.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "rt/seed.hpp"

namespace rowe::json {
namespace digits_test {
namespace {

// Runs `write` in front of canaries, and fails when more than number_buffer_bytes were touched.
template <class Write>
std::string text_of(Write write) {
  constexpr char canary = '#';
  std::string buffer(2 * number_buffer_bytes, canary);
  const char* const end = write(buffer.data());
  EXPECT_EQ(buffer.find_first_not_of(canary, number_buffer_bytes), std::string::npos)
      << "wrote beyond its buffer";
  return {buffer.data(), static_cast<std::size_t>(end - buffer.data())};
}

std::string of(double x) {
  return text_of([x](char* at) { return write_double(at, x); });
}
std::string of(float x) {
  return text_of([x](char* at) { return write_float(at, x); });
}
std::string fixed(double x, int decimals) {
  return text_of([=](char* at) { return write_fixed(at, x, decimals); });
}

double random_double(std::mt19937_64& random) {
  for (;;) {
    const auto x = std::bit_cast<double>(random());
    if (std::isfinite(x)) return x;
  }
}

// The digits from the first to the last that is not 0.
std::string significant_digits(std::string_view text) {
  std::string digits;
  for (const char c : text.substr(0, text.find('e'))) {
    if (c >= '0' && c <= '9') digits += c;
  }
  digits.erase(0, digits.find_first_not_of('0'));
  digits.erase(digits.find_last_not_of('0') + 1);
  return digits;
}

// Read by the C library, the text is the same bits; and it is not too long.
bool reads_back(const std::string& text, double x) {
  return text.size() <= double_text_bytes_max &&
         std::bit_cast<std::uint64_t>(std::strtod(text.c_str(), nullptr)) == std::bit_cast<std::uint64_t>(x);
}
bool reads_back(const std::string& text, float x) {
  return text.size() <= float_text_bytes_max &&
         std::bit_cast<std::uint32_t>(std::strtof(text.c_str(), nullptr)) == std::bit_cast<std::uint32_t>(x);
}

// Each text as it stands, of the number that it says.
void expect_doubles(std::initializer_list<const char*> texts) {
  for (const char* text : texts) EXPECT_EQ(of(std::strtod(text, nullptr)), text);
}
void expect_floats(std::initializer_list<const char*> texts) {
  for (const char* text : texts) EXPECT_EQ(of(std::strtof(text, nullptr)), text);
}

TEST(digits, writes_integers_without_a_point_but_for_the_sign_of_zero) {
  expect_doubles({"0", "-0.0", "1", "-2", "100", "1000000000000000", "9007199254740991"});
  expect_floats({"-0.0", "16777215"});
}

TEST(digits, writes_what_is_not_too_large_or_small_plainly) {
  expect_doubles({"0.1", "-0.25", "3.141592653589793", "1234567.875", "1700000000.123456",
                  "0.30000000000000004", "0.000001", "0.0000012345678901234567", "4503599627370495.5"});
  expect_floats({"0.1"});
  EXPECT_EQ(of(0.00000123456789f), "0.0000012345679");
}

TEST(digits, writes_the_rest_with_an_exponent) {
  expect_doubles({"9.9e-7", "1e-7", "9.007199254740992e15", "1e16", "-1.5e300", "1.7976931348623157e308",
                  "2.2250738585072014e-308", "5e-324"});
  expect_doubles({"1.8446744073709552e19"}); // 2^64: as an integer some parsers would refuse it
  expect_floats({"1.6777216e7", "3.4028235e38", "1e-45"});
}

TEST(digits, of_floats_read_back_to_the_same_bits) {
  tests::seeded random;
  for (int i = 0; i < 1'000'000; ++i) {
    const auto x = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(x)) continue;
    ASSERT_TRUE(reads_back(of(x), x)) << of(x);
  }
}

// The same digits as the standard library's, and back to the same bits. What looks like an integer is one,
// and exact in every reader.
void judge(double x) {
  const std::string text = of(x);
  char theirs[64];
  const char* const end = std::to_chars(theirs, theirs + sizeof theirs, x, std::chars_format::scientific).ptr;
  ASSERT_EQ(significant_digits(text), significant_digits({theirs, end})) << text;
  ASSERT_TRUE(reads_back(text, x)) << text;
  ASSERT_TRUE(text.find_first_of(".e") != std::string::npos || std::fabs(x) < 0x1p53) << text;
}

TEST(digits, of_doubles_read_back_and_are_as_few_as_those_of_the_standard_library) {
  tests::seeded random;
  for (int i = 0; i < 1'000'000 && !HasFatalFailure(); ++i) judge(random_double(random));
}

// The nearest of the shortest decimals; and the neighbours of short decimals, whose digits are decided by the
// last bits, of powers of two, and of what is exactly between two decimals.
TEST(digits, of_everyday_doubles_are_those_of_the_standard_library) {
  tests::seeded random;
  const auto uniform = [&random](int below) {
    return static_cast<int>(random() % static_cast<unsigned>(below));
  };
  for (int i = 0; i < 100'000; ++i) {
    const int exponent = uniform(90) - 30; // metres, radians, stamps
    judge(std::ldexp(static_cast<double>(random() >> 11), exponent - 53));
    judge(-std::ldexp(static_cast<double>(random() >> (11 + uniform(53))), exponent - 53));
    double decimal = static_cast<double>(random() % 100'000'000) / std::pow(10, uniform(15));
    for (int steps = uniform(4); steps >= 0; --steps) decimal = std::nextafter(decimal, 0);
    for (int steps = 0; steps < 6; ++steps) {
      judge(decimal);
      decimal = std::nextafter(decimal, 1e9);
    }
  }
  for (int exponent = -25; exponent < 55; ++exponent) {
    for (const double x :
         {std::ldexp(1, exponent), std::ldexp(3, exponent), std::ldexp(0x1p53 - 1, exponent)}) {
      judge(std::nextafter(x, 0));
      judge(x);
      judge(std::nextafter(x, 1e300));
    }
  }
}

TEST(digits, of_integers_are_those_of_the_standard_library) {
  const auto check = [](std::uint64_t x) {
    char theirs[32];
    const char* end = std::to_chars(theirs, theirs + sizeof theirs, x).ptr;
    ASSERT_EQ(text_of([x](char* at) { return write_unsigned(at, x); }), std::string_view(theirs, end));
    const auto y = static_cast<std::int64_t>(x);
    end = std::to_chars(theirs, theirs + sizeof theirs, y).ptr;
    ASSERT_EQ(text_of([y](char* at) { return write_signed(at, y); }), std::string_view(theirs, end));
  };
  std::uint64_t power = 1;
  for (int i = 0; i < 20; ++i, power *= 10) {
    check(power - 1);
    check(power);
    check(power + 1);
    check(0 - power);
  }
  for (int bit = 0; bit < 64; ++bit) check(std::uint64_t{1} << bit);
  check(std::numeric_limits<std::uint64_t>::max());
  check(static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::min()));

  tests::seeded random;
  for (int i = 0; i < 100'000; ++i) check(random() >> random() % 64);
}

TEST(digits, of_fixed_precision_are_rounded_and_end_in_no_zero) {
  EXPECT_EQ(fixed(3.14159265, 4), "3.1416");
  EXPECT_EQ(fixed(-3.14159265, 2), "-3.14");
  EXPECT_EQ(fixed(2.0, 9), "2");
  EXPECT_EQ(fixed(2.5, 9), "2.5");
  EXPECT_EQ(fixed(0.005, 3), "0.005");
  EXPECT_EQ(fixed(0.999999, 3), "1");
  EXPECT_EQ(fixed(1.05, 0), "1");
  EXPECT_EQ(fixed(123456.000000001, 9), "123456.000000001");
}

TEST(digits, of_fixed_precision_have_no_negative_zero) {
  EXPECT_EQ(fixed(-0.0, 3), "0");
  EXPECT_EQ(fixed(-0.0004, 3), "0");
  EXPECT_EQ(fixed(-0.0006, 3), "-0.001");
}

TEST(digits, of_numbers_too_large_for_their_precision_are_exact) {
  EXPECT_EQ(fixed(1e300, 9), "1e300");
  EXPECT_EQ(fixed(12345678.123456789, 9), of(12345678.123456789));
}

TEST(digits, of_fixed_precision_are_within_half_a_unit) {
  tests::seeded random;
  std::uniform_real_distribution<double> metres{-1000, 1000};
  for (int i = 0; i < 100'000; ++i) {
    const double x = metres(random);
    const int decimals = static_cast<int>(random() % (decimals_max + 1));
    const std::string text = fixed(x, decimals);
    const double unit = std::pow(10.0, -decimals);
    ASSERT_NEAR(std::strtod(text.c_str(), nullptr), x, 0.5 * unit + 1e-12) << text;
    const auto point = text.find('.');
    const std::size_t digits = point == std::string::npos ? 0 : text.size() - point - 1;
    ASSERT_LE(digits, static_cast<std::size_t>(decimals)) << text;
  }
}

} // namespace
} // namespace digits_test
} // namespace rowe::json
