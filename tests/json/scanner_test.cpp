// SPDX-License-Identifier: Apache-2.0
// reader_test.cpp asks the scanner about each of its texts, too, cut in every place.
#include "json/reading/scanner.hpp"

#include <cfloat>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <simdjson.h>

#include "respelled.hpp"
#include "scanned.hpp"
#include "texts.hpp"
#include "json/reading/numbers.hpp"

namespace rowe::json {
namespace scanner_test {
namespace {

using tests::concat;
using tests::repeat;
using tests::scanned;

constexpr std::size_t depth_max = 16;

fault of_whole(std::string_view text) { return find_fault(text, depth_max); }
fault of_pieces(std::string_view text, std::size_t bytes) {
  return scanned(text, depth_max, [bytes] { return bytes; }).found();
}

TEST(scanner, notes_the_first_of_many_members_and_says_so) {
  std::string text = "{";
  for (int i = 0; i < 40; ++i) text += "\"" + std::to_string(i) + "\":[{}],";
  text.back() = '}';
  const scanner s = scanned(text, depth_max, [] { return 5; });
  EXPECT_EQ(s.found().what, fault_kind::none);
  EXPECT_EQ(s.members().size(), scanner::members_max);
  EXPECT_TRUE(s.has_more_members());
  EXPECT_TRUE(tests::notes_what_is_walked(s, text));
}

TEST(scanner, tells_members_before_the_text_ends) {
  scanner s;
  ASSERT_TRUE(s.feed(R"({"op":"publish","topic":"/map","msg":{"da)"));
  ASSERT_EQ(s.members().size(), 2U);
  EXPECT_EQ(s.members()[1].raw, (stretch{24, 6}));
}

TEST(scanner, stops_at_the_first_wrong_byte_and_stays_there) {
  scanner s;
  EXPECT_TRUE(s.feed("[1,"));
  EXPECT_FALSE(s.feed("2 3]"));
  EXPECT_EQ(s.found().what, fault_kind::malformed);
  EXPECT_EQ(s.found().at, 5U);
  EXPECT_FALSE(s.feed("]"));
  EXPECT_FALSE(s.finish());
  EXPECT_EQ(s.found().at, 5U);
  EXPECT_EQ(s.bytes(), 3U);
}

TEST(scanner, does_not_wait_for_more_to_refuse_a_depth) {
  scanner s{3};
  EXPECT_FALSE(s.feed("[[[["));
  EXPECT_EQ(s.found().what, fault_kind::too_deep);
  EXPECT_EQ(s.found().at, 3U);
}

// ---- numbers at the end of what a double holds ----

// Both without a sign.
std::string sum(std::string a, std::string_view b) {
  int carry = 0;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    const int digit = a[a.size() - i] - '0' + carry + (i <= b.size() ? b[b.size() - i] - '0' : 0);
    a[a.size() - i] = static_cast<char>('0' + digit % 10);
    carry = digit / 10;
  }
  return a;
}
std::string written(double x) {
  std::string text(400, '\0');
  text.resize(static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.0f", x)));
  return text;
}
// The middle between the largest double and the next power of two, which rounds to that.
std::string limit() { return sum(written(DBL_MAX), written(std::ldexp(1.0, 970))); }

std::string less_by_one(std::string number) {
  --number.back(); // the limit is even and does not end with 0
  return number;
}

void judged_alike(std::string_view number, bool expected) {
  EXPECT_EQ(of_whole(number).what == fault_kind::none, expected) << number;
  for (const std::size_t bytes : {std::size_t{1}, std::size_t{7}, number.size()}) {
    EXPECT_TRUE(of_pieces(number, bytes) == of_whole(number)) << number;
  }
  // Complete in one piece, with something behind it.
  const std::string in_array = concat({"[0,", number, ",", number, "]"});
  const std::string in_object = concat({"{\"a\":", number, "}"});
  EXPECT_TRUE(of_whole(in_array) == (expected ? fault{} : fault{fault_kind::malformed, 3})) << number;
  EXPECT_TRUE(of_whole(in_object) == (expected ? fault{} : fault{fault_kind::malformed, 5})) << number;
}

TEST(scanner, knows_the_last_number_that_a_double_holds) {
  const std::string refused = limit(), accepted = less_by_one(refused);
  ASSERT_EQ(refused.size(), 309U);
  judged_alike(accepted, true);
  judged_alike(refused, false);
  judged_alike(concat({"-", accepted}), true);
  judged_alike(concat({"-", refused}), false);
  judged_alike(concat({accepted, ".", repeat("9", 400)}), true);
  judged_alike(concat({refused, ".", repeat("0", 400)}), false);
}

TEST(scanner, knows_it_wherever_the_point_and_the_exponent_are) {
  const std::string refused = limit(), accepted = less_by_one(refused);
  for (const auto& [digits, expected] : {std::pair{accepted, true}, std::pair{refused, false}}) {
    for (const std::size_t point : {1U, 2U, 150U, 308U}) {
      const std::string exponent = std::to_string(309 - point);
      judged_alike(concat({digits.substr(0, point), ".", digits.substr(point), "e", exponent}), expected);
      judged_alike(concat({"0.", repeat("0", point), digits, "E+", std::to_string(309 + point)}), expected);
      judged_alike(concat({digits, repeat("0", point), "e-", std::to_string(point)}), expected);
    }
  }
}

// ---- the same as for the whole text, whatever the text ----

class against_the_whole : public ::testing::Test {
 protected:
  std::size_t within(std::size_t end) { return random_() % end; }

  // Numbers around the limit, with zeros, points and exponents that hide where they are.
  std::string number() {
    std::string digits = within(2) == 0 ? limit() : std::to_string(random_());
    digits.resize(1 + within(digits.size()));
    if (within(3) == 0) digits += repeat(within(2) == 0 ? "0" : "9", within(400));
    if (within(4) == 0) digits.back() = static_cast<char>('0' + within(10));
    std::string text = within(3) == 0 ? "-" : "";
    const std::size_t point = within(digits.size() + 1);
    if (point == 0) {
      text += "0." + repeat("0", within(50)) + digits;
    } else {
      text += digits[0] == '0' ? "0." + digits : digits.substr(0, point);
      if (point < digits.size() && digits[0] != '0') text += "." + digits.substr(point);
    }
    const auto scale = static_cast<int>(within(700)) - 350;
    if (within(2) == 0) text += "e" + std::to_string(within(2) == 0 ? 309 - static_cast<int>(point) : scale);
    return text;
  }

  // One byte is changed, goes, or comes.
  void damage(std::string& text) {
    static constexpr std::string_view likely =
        "{}[]\",:\\u0019eE+-.tfn \n\x1f\xc3\xa9\xed\xa0\xf4\x90\xe2\x82";
    const std::size_t at = within(text.size());
    switch (within(3)) {
    case 0: text[at] = likely[within(likely.size())]; break;
    case 1: text.erase(at, 1); break;
    default: text.insert(at, 1, likely[within(likely.size())]); break;
    }
  }

  void judged_alike(std::string_view text) {
    const fault whole = of_whole(text);
    const scanner s = scanned(text, depth_max, [&] { return 1 + within(within(2) == 0 ? 4 : 90); });
    simdjson::dom::element element;
    const simdjson::error_code error = dom_.parse(text.data(), text.size()).get(element);
    if (error != simdjson::NUMBER_ERROR) { // of integers beyond 64 bits, which are valid here, and numbers()
      ASSERT_EQ(error == simdjson::SUCCESS, whole.what == fault_kind::none) << text << '\n' << error;
    }
    ASSERT_TRUE(s.found() == whole) << text << "\nwhole: " << int(whole.what) << " at " << whole.at
                                    << ", in pieces: " << int(s.found().what) << " at " << s.found().at;
    if (whole.what != fault_kind::none) return;
    ASSERT_TRUE(tests::notes_what_is_walked(s, text)) << text;
    ++valid_;
  }

  simdjson::dom::parser dom_;
  std::mt19937_64 random_{20261126};
  int valid_ = 0;
};

TEST_F(against_the_whole, numbers) {
  for (int i = 0; i < 20'000; ++i) {
    const std::string one = number();
    judged_alike(one);
    ASSERT_EQ(of_whole(one).what == fault_kind::none, nearest_double(one).has_value()) << one;
  }
  EXPECT_GT(valid_, 5'000);
  EXPECT_LT(valid_, 19'000);
}

TEST_F(against_the_whole, texts_that_are_damaged_here_and_there) {
  const std::string_view text =
      R"({"op":"publish","topic":"\/odom\u00e9","msg":{"x":[1,-2.5e-3,{"y":"ü\ud83d\ude00€😀"},[]],"z":{}},)"
      R"("more":[true,false,null,"a text that is longer than two blocks of a vector register\n\\"]})";
  ASSERT_EQ(of_whole(text).what, fault_kind::none);
  tests::respelling spelling{random_, 200};
  for (int i = 0; i < 20'000; ++i) {
    std::string one = spelling.text(root(text));
    for (std::size_t times = within(3); times > 0; --times) damage(one);
    if (within(8) == 0) one.resize(within(one.size()));
    judged_alike(one);
  }
  EXPECT_GT(valid_, 5'000);
  EXPECT_LT(valid_, 15'000);
}

TEST_F(against_the_whole, texts_longer_than_any_buffer) {
  std::string text = R"({"op":"publish","topic":"/map","msg":{"data":[)";
  while (text.size() < 4'000'000) text += std::to_string(static_cast<int>(within(201)) - 100) + ",";
  text += R"(0],"image":")" + repeat("iVBORw0KGgoAAAANSUhEUgAA", 20'000) + R"("},"latch":true})";
  judged_alike(text);
  EXPECT_EQ(valid_, 1);
  text[text.size() / 2] = 'x';
  judged_alike(text);
  EXPECT_EQ(valid_, 1);
}

} // namespace
} // namespace scanner_test
} // namespace rowe::json
