// SPDX-License-Identifier: Apache-2.0
#include "json/structs/decoder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/ros.hpp>

#include "checked_decoder.hpp"
#include "decodable.hpp"
#include "encoded.hpp"
#include "respelled.hpp"
#include "rt/seed.hpp"
#include "texts.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"

namespace decoder_test {
namespace {

struct preset {
  std::optional<int> maybe = 5;
  int other = 7;
  std::int8_t not_listed = 9;
};
struct constant {
  const int fixed = 1;
};
struct with_constant {
  std::array<constant, 2> inside{};
};
struct no_default {
  explicit no_default(int x) : value{x} {}
  int value;
};
struct maybe_no_default {
  std::optional<no_default> maybe;
};
struct constant_count {
  int values[2]{};
  const int count = 1;
};

} // namespace
} // namespace decoder_test

// clang-format off
template <> inline constexpr auto rowe::schema<decoder_test::preset> =
    rowe::fields<&decoder_test::preset::maybe, &decoder_test::preset::other>{};
template <> inline constexpr auto rowe::schema<decoder_test::constant> =
    rowe::fields<&decoder_test::constant::fixed>{};
template <> inline constexpr auto rowe::schema<decoder_test::with_constant> =
    rowe::fields<&decoder_test::with_constant::inside>{};
template <> inline constexpr auto rowe::schema<decoder_test::no_default> =
    rowe::fields<&decoder_test::no_default::value>{};
template <> inline constexpr auto rowe::schema<decoder_test::maybe_no_default> =
    rowe::fields<&decoder_test::maybe_no_default::maybe>{};
template <> inline constexpr auto rowe::schema<decoder_test::constant_count> =
    rowe::fields<rowe::counted<&decoder_test::constant_count::values, &decoder_test::constant_count::count>>{};
// clang-format on

namespace rowe::json {
namespace decoder_test {
using namespace ::decoder_test;
namespace {

using tests::anything;
using tests::concat;
using tests::decode;
using tests::decoded;
using tests::decoder_of;
using tests::diagnosis_of;
using tests::encoded;
using tests::everything;
using tests::gear;
using tests::numbers;
using tests::point;
using tests::refused;
using tests::repeat;

// ---- one value of each sort; `anything` reads a member alone ----

std::string member(std::string_view name, std::string_view value) {
  return concat({"{\"", name, "\":", value, "}"});
}
constexpr std::int64_t value_at = 5; // in {"d":1}

TEST(decoder, knows_the_limits_of_every_integer) {
  struct {
    std::string_view name, below, least, most, above;
  } const limits[] = {
      {"i8", "-129", "-128", "127", "128"},
      {"i16", "-32769", "-32768", "32767", "32768"},
      {"i32", "-2147483649", "-2147483648", "2147483647", "2147483648"},
      {"i64", "-9223372036854775809", "-9223372036854775808", "9223372036854775807", "9223372036854775808"},
      {"u8", "-1", "0", "255", "256"},
      {"u16", "-1", "0", "65535", "65536"},
      {"u32", "-1", "0", "4294967295", "4294967296"},
      {"u64", "-1", "0", "18446744073709551615", "18446744073709551616"},
      {"g", "-129", "-128", "127", "128"}};
  for (const auto& of : limits) {
    const std::string name = concat({"\"", of.name, "\":"});
    const auto text = [&](std::string_view value) {
      std::string all = R"({"yes":true,"f":0,"d":0)";
      for (const auto& any : limits)
        all += concat({",\"", any.name, "\":", any.name == of.name ? value : "0"});
      return all + "}";
    };
    for (const std::string_view value : {of.least, of.most})
      EXPECT_NE(encoded(decoded<numbers>(text(value))).find(name + std::string{value}), std::string::npos);
    for (const std::string_view value : {of.below, of.above}) {
      const std::size_t place = text(value).find(name) + name.size();
      EXPECT_EQ(refused<numbers>(text(value)), (error{errc::out_of_range, static_cast<std::int64_t>(place)}));
    }
  }
}

TEST(decoder, reads_whole_numbers_however_they_are_written) {
  for (const std::string_view seven :
       {"7", "7.0", "7e0", "70e-1", "0.7e1", "0.007E+3", "7.00000000000000000000000",
        "0.00000000000000000000007e23", "7000000000000000000000000e-24"}) {
    EXPECT_EQ(decoded<anything>(member("i64", seven)).i64, 7) << seven;
    EXPECT_EQ(decoded<anything>(member("i8", seven)).i8, 7) << seven;
  }
  EXPECT_EQ(decoded<anything>(member("i64", "-1e3")).i64, -1000);
  EXPECT_EQ(decoded<anything>(member("u64", "1.8446744073709551615e19")).u64, 18446744073709551615u);
  for (const std::string_view zero : {"0", "-0", "0.0", "-0.0", "0e99999999999999999999", "-0e-7"}) {
    EXPECT_EQ(decoded<anything>(member("u64", zero)).u64, 0u) << zero;
    EXPECT_EQ(decoded<anything>(member("i8", zero)).i8, 0) << zero;
  }
}

TEST(decoder, refuses_what_browsers_write_for_integers_beyond_64_bits) {
  for (const std::string_view large :
       {"18446744073709552000", "1e21", "1e300", "10000000000000000000000.0"}) {
    for (const std::string_view name : {"u64", "i64", "i8"}) {
      EXPECT_EQ(refused<anything>(member(name, large)).code, errc::out_of_range) << large;
    }
  }
}

TEST(decoder, takes_fractions_for_no_integers) {
  for (const std::string_view fraction :
       {"0.5", "1e-1", "7.00000000000000000000001", "1e-400", "123456789e-1"}) {
    EXPECT_EQ(refused<anything>(member("i64", fraction)), (error{errc::wrong_type, value_at + 2}))
        << fraction;
  }
}

TEST(decoder, reads_integers_in_quotes_where_the_schema_writes_them_so) {
  EXPECT_EQ(decoded<anything>(R"({"s":"-2147483648"})").s, std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(decoded<anything>(R"({"s":"12"})").s, 12);
  EXPECT_EQ(decoded<anything>(R"({"s":12})").s, 12);
  EXPECT_EQ(decoded<anything>(R"({"s":"\u0031\u0032"})").s, 12);
  EXPECT_EQ(decoded<anything>(R"({"s":"-0"})").s, 0);
  EXPECT_EQ(refused<anything>(R"({"s":"2147483648"})"), (error{errc::out_of_range, value_at}));
  EXPECT_EQ(refused<anything>(member("s", '"' + repeat("9", 400) + '"')),
            (error{errc::out_of_range, value_at}));
  for (const std::string_view text :
       {"\"\"", "\"-\"", "\"1.0\"", "\"1e3\"", "\"+1\"", "\" 1\"", "\"1 \"", "\"007\"", "\"--1\"", "\"1-\"",
        "\"0x1\"", "\"\\u00e9\"", "\"99999999999a\""}) {
    EXPECT_EQ(refused<anything>(member("s", text)), (error{errc::wrong_type, value_at})) << text;
  }
  EXPECT_EQ(refused<anything>(R"({"i64":"12"})").code, errc::wrong_type);
}

TEST(decoder, keeps_the_sign_of_zero) {
  for (const std::string_view zero : {"-0", "-0.0", "-0e5", "-1e-400"}) {
    EXPECT_TRUE(std::signbit(*decoded<anything>(member("d", zero)).d)) << zero;
    EXPECT_TRUE(std::signbit(*decoded<anything>(member("f", zero)).f)) << zero;
    EXPECT_EQ(decoded<anything>(member("d", zero)).d, 0) << zero;
  }
  EXPECT_FALSE(std::signbit(*decoded<anything>(R"({"d":0})").d));
}

TEST(decoder, rounds_floats_once) {
  // A double away from it lies in the middle of two floats, or would be one.
  EXPECT_EQ(decoded<anything>(R"({"f":16777217})").f, 16777216.0f);
  EXPECT_EQ(decoded<anything>(R"({"f":16777217.0000000000000001})").f, 16777218.0f);
  EXPECT_EQ(decoded<anything>(R"({"f":16777216.9999999999999999})").f, 16777216.0f);
  EXPECT_EQ(decoded<anything>(R"({"f":1e-46})").f, 0.0f);
  EXPECT_EQ(decoded<anything>(R"({"f":1.401298464324817e-45})").f, std::numeric_limits<float>::denorm_min());
  EXPECT_EQ(decoded<anything>(R"({"f":3.4028235677973365e38})").f, std::numeric_limits<float>::max());
  EXPECT_EQ(refused<anything>(R"({"f":3.4028235677973367e38})"), (error{errc::out_of_range, value_at}));
  EXPECT_EQ(refused<anything>(R"({"f":-1e39})"), (error{errc::out_of_range, value_at}));
}

TEST(decoder, reads_every_number_as_the_c_library_does) {
  tests::seeded random;
  for (int i = 0; i < 200'000; ++i) {
    std::string text = random() % 2 == 0 ? "-" : "";
    const std::size_t digits = 1 + random() % (random() % 8 == 0 ? 40 : 20);
    const std::size_t point = random() % (digits + 1);
    for (std::size_t k = 0; k < digits; ++k) {
      if (k == point && k > 0) text += '.';
      text += k == 0 ? static_cast<char>('1' + random() % 9) : static_cast<char>('0' + random() % 10);
    }
    if (random() % 2 == 0) text += "e" + std::to_string(static_cast<int>(random() % 60) - 30);
    const decimal d = read_decimal(text.data(), text.data() + text.size());
    ASSERT_EQ(d.text(), text);
    double x = 0;
    ASSERT_TRUE(to_real(d, x)) << text;
    ASSERT_EQ(x, std::strtod(text.c_str(), nullptr)) << text;
    const float expected = std::strtof(text.c_str(), nullptr);
    float f = expected;
    ASSERT_EQ(to_real(d, f), std::isfinite(expected)) << text;
    ASSERT_EQ(f, expected) << text;
  }
}

TEST(decoder, rounds_every_float_and_its_neighbourhood_as_the_c_library_does) {
  tests::seeded random;
  std::array<char, 1100> text;
  for (int i = 0; i < 100'000; ++i) {
    const auto x = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(x)) continue;
    const double next = static_cast<double>(std::nextafter(x, INFINITY));
    if (!std::isfinite(next)) continue;
    const double middle = (static_cast<double>(x) + next) / 2;
    const int precision = random() % 2 == 0 ? 800 : 15 + static_cast<int>(random() % 4);
    const int bytes = std::snprintf(text.data(), text.size(), "%.*e", precision, middle);
    if (random() % 2 == 0) text[precision < 100 ? 5 : 700] = '1'; // a little beside the middle
    const decimal d = read_decimal(text.data(), text.data() + bytes);
    float f = 0;
    ASSERT_TRUE(to_real(d, f)) << text.data();
    ASSERT_EQ(f, std::strtof(text.data(), nullptr)) << text.data();
  }
}

TEST(decoder, refuses_strings_that_are_too_long) {
  EXPECT_EQ(decoded<anything>(R"({"text":"12345"})").text->view(), "12345");
  EXPECT_EQ(refused<anything>(R"({"text":"123456"})"), (error{errc::too_long, 6, 5}));
  EXPECT_EQ(decoded<anything>(R"({"text":"\u0031\u0032\u0033\u0034\u0035"})").text->view(), "12345");
  EXPECT_EQ(refused<anything>(R"({"text":"\ud83d\ude00\u00e9"})"), (error{errc::too_long, 6, 5}));
  EXPECT_EQ(refused<anything>(member("text", '"' + repeat("\\n", 70'000) + '"')),
            (error{errc::too_long, 70'000, 5}));
}

TEST(decoder, reads_sequences_up_to_what_they_hold_and_null_as_a_number_that_is_none) {
  EXPECT_EQ(decoded<anything>(R"({"list":[]})").list->size(), 0u);
  const auto full = decoded<anything>(R"({"list": [ 1 , 2.5,null ] })");
  ASSERT_EQ(full.list->size(), 3u);
  EXPECT_EQ((*full.list)[1], 2.5);
  EXPECT_TRUE(std::isnan((*full.list)[2]));
  EXPECT_EQ(refused<anything>(R"({"list":[1,2,3,[4,"]"],{"a":[]}]})"), (error{errc::too_long, 5, 3}));
}

TEST(decoder, demands_the_exact_length_of_fixed_arrays) {
  EXPECT_EQ((*decoded<anything>(R"({"two":[1,2]})").two)[1], 2);
  EXPECT_EQ(refused<anything>(R"({"two":[1]})"), (error{errc::too_long, 1, 2}));
  EXPECT_EQ(refused<anything>(R"({"two":[]})"), (error{errc::too_long, 0, 2}));
  EXPECT_EQ(refused<anything>(R"({"two":[1,2,3,4]})"), (error{errc::too_long, 4, 2}));
  EXPECT_EQ(refused<anything>(R"({"two":[1,256,3,4]})"), (error{errc::out_of_range, 10}));
}

TEST(decoder, leaves_optionals_empty_that_are_null_or_missing) {
  const auto nothing = decoded<anything>("{}");
  EXPECT_EQ(encoded(nothing), "{}");
  const auto nulls = decoded<anything>(R"({"yes":null,"i8":null,"d":null,"text":null,"list":null,"two":null,)"
                                       R"("twice":null})");
  EXPECT_EQ(encoded(nulls), "{}");
  EXPECT_EQ(decoded<anything>(R"({"twice":7})").twice, std::optional{std::optional<std::int16_t>{7}});
}

TEST(decoder, refuses_values_of_another_type) {
  for (const std::string_view name : {"yes", "i8", "u64", "f", "d", "text", "list", "two", "twice"}) {
    std::size_t fit = 0;
    for (const std::string_view value : {"true", "1", "1.5", "\"a\"", "{}", "[]", "[true]", "[1,1]"}) {
      anything x;
      if (decode(member(name, value), x)) ++fit;
    }
    EXPECT_EQ(fit, name == "f" || name == "d" || name == "list" ? 2U : 1U) << name;
  }
  EXPECT_EQ(refused<point>(R"({"x":1,"y":"2"})"), (error{errc::wrong_type, 11}));
  EXPECT_EQ(refused<ros::time>(R"({"secs":null,"nsecs":0})"), (error{errc::wrong_type, 8}));
}

// ---- objects ----

TEST(decoder, refuses_what_is_no_object) {
  for (const std::string_view text : {"[]", "1", "null", "\"{}\"", "true", " []"}) {
    EXPECT_EQ(refused<point>(text), error{errc::not_an_object}) << text;
  }
  point p;
  EXPECT_EQ(decoder_of<point>().decode("", &p).error(), error{errc::not_an_object});
  EXPECT_EQ(decoded<point>(" \n{\"x\":5,\"y\":6} ").x, 5);
}

TEST(decoder, passes_over_members_that_it_does_not_know) {
  const auto p = decoded<point>(R"({"z":{"x":[1,{"y":"}"}]},"x":5,"xx":"\"","":null,"y":6,"z":7,"Y":8})");
  EXPECT_EQ(p.x, 5);
  EXPECT_EQ(p.y, 6);
}

TEST(decoder, refuses_members_that_occur_twice) {
  EXPECT_EQ(refused<point>(R"({"x":1,"x":2,"y":3})"), (error{errc::duplicate_member, 7}));
  EXPECT_EQ(refused<point>(R"({"x":1,"y":2,"x":3})"), (error{errc::duplicate_member, 13}));
  EXPECT_EQ(refused<point>(R"({"x":1,"\u0078":2,"y":3})"), (error{errc::duplicate_member, 7}));
  EXPECT_EQ(refused<point>(R"({"\u0078":1,"x":2,"y":3})"), (error{errc::duplicate_member, 12}));
  EXPECT_EQ(refused<anything>(R"({"d":null,"d":1})").code, errc::duplicate_member);
  EXPECT_EQ(refused<anything>(R"({"d":1,"d":"no number"})").code, errc::duplicate_member);
}

TEST(decoder, refuses_to_do_without_members) {
  EXPECT_EQ(refused<point>("{}"), (error{errc::missing_member, 1}));
  EXPECT_EQ(refused<point>(R"({"x":1})"), (error{errc::missing_member, 2}));
  // Of odometry: header 1, seq 2, stamp 3, secs 4, nsecs 5, frame_id 6, child_frame_id 7.
  EXPECT_EQ(refused<ros::odometry>(R"({"header":{"seq":1,"stamp":{"secs":1},"frame_id":""}})"),
            (error{errc::missing_member, 5}));
  EXPECT_EQ(
      refused<ros::odometry>(R"({"header":{"seq":1,"stamp":{"secs":1,"nsecs":2},"frame_id":""},"pose":{}})"),
      (error{errc::missing_member, 9}));
}

// ROS 2's headers have no seq, and its stamps other names.
TEST(decoder, reads_headers_of_either_ros_into_either_struct) {
  constexpr std::string_view ros1 = R"({"seq":7,"stamp":{"secs":1,"nsecs":2},"frame_id":"odom"})";
  constexpr std::string_view ros2 = R"({"stamp":{"sec":1,"nanosec":2},"frame_id":"odom"})";
  for (const std::string_view text : {ros1, ros2}) {
    const auto one = decoded<ros::header>(text);
    EXPECT_EQ(one.seq, text == ros1 ? 7U : 0U);
    EXPECT_EQ(one.stamp.secs, 1U);
    EXPECT_EQ(one.stamp.nsecs, 2U);
    EXPECT_EQ(one.frame_id.view(), "odom");
    const auto two = decoded<ros2::header>(text);
    EXPECT_EQ(two.stamp.sec, 1);
    EXPECT_EQ(two.stamp.nanosec, 2U);
    EXPECT_EQ(two.frame_id.view(), "odom");
  }
  EXPECT_EQ(decoded<ros2::time>(R"({"nanosec":4,"sec":-3})").sec, -3);
  EXPECT_EQ(decoded<ros::time>(R"({"nanosec":4,"secs":3})").nsecs, 4U); // even mixed
}

TEST(decoder, takes_two_names_of_a_member_for_that_member) {
  EXPECT_EQ(refused<ros::time>(R"({"secs":1,"sec":1,"nsecs":2})"), (error{errc::duplicate_member, 10}));
  EXPECT_EQ(refused<ros::time>(R"({"sec":1,"secs":1,"nsecs":2})"), (error{errc::duplicate_member, 9}));
  EXPECT_EQ(refused<ros::time>(R"({"sec":1})"), (error{errc::missing_member, 2}));
  EXPECT_EQ(refused<ros::time>(R"({"sec":1,"sec":1,"nanosec":2})").code, errc::duplicate_member);
  EXPECT_EQ(decoded<ros::time>(R"({"\u0073ec":1,"nanosec":2})").secs, 1U);
}

TEST(decoder, fills_in_what_is_missing_where_it_is_asked_to) {
  const decoder d = decoder::compile(describe<preset>(), decoder::missing::filled).value();
  preset p;
  p.other = 1;
  ASSERT_TRUE(d.decode(R"({"maybe":3})", &p));
  EXPECT_EQ(p.maybe, 3);
  EXPECT_EQ(p.other, 7);
  ASSERT_TRUE(d.decode("{}", &p));
  EXPECT_EQ(p.maybe, 5);
  ASSERT_TRUE(d.decode(R"({"maybe":null})", &p));
  EXPECT_EQ(p.maybe, std::nullopt);

  // Inside of others, too.
  const decoder twist = decoder::compile(describe<ros::twist>(), decoder::missing::filled).value();
  ros::twist t{.linear = {9, 9, 9}, .angular = {9, 9, 9}};
  ASSERT_TRUE(twist.decode(R"({"linear":{"x":0.1}})", &t));
  EXPECT_EQ(t.linear.x, 0.1);
  EXPECT_EQ(t.linear.y, 0);
  EXPECT_EQ(t.angular.z, 0);
  EXPECT_EQ(twist.decode(R"({"linear":{},"linear":{}})", &t).code(), errc::duplicate_member);
}

TEST(decoder, says_which_member_was_wanted_and_what_was_found) {
  EXPECT_EQ(diagnosis_of<ros::twist>(R"({"linear":{"x":0.1}})"),
            R"(the member "linear.y" is missing; a number is wanted)");
  EXPECT_EQ(diagnosis_of<ros::twist>("{}"), R"(the member "linear" is missing; an object is wanted)");
  EXPECT_EQ(diagnosis_of<ros::twist>(R"({"linear":[1,2,3]})"),
            R"(the member "linear" must be an object; it is [1,2,3])");
  EXPECT_EQ(diagnosis_of<ros::twist>(R"({"linear":{"x":"fast"}})"),
            R"(the member "linear.x" must be a number; it is "fast")");
  EXPECT_EQ(diagnosis_of<ros::twist>(" [1] "), "a JSON object is wanted; it is [1]");
  EXPECT_EQ(diagnosis_of<ros::twist>("7"), "a JSON object is wanted; it is 7");
  EXPECT_EQ(diagnosis_of<point>(R"({"x":1,"x":2})"), R"(the member "x" occurs twice)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"i8":300})"),
            R"(the member "i8" must be a whole number from -128 to 127 or null; it is 300)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"u64":-1 })"),
            R"(the member "u64" must be a whole number of 64 bits that is not negative or null; it is -1)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"f":1e300})"),
            R"(the member "f" must be a number of single precision or null; it is 1e300)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"text":"sixsix"})"),
            R"(the member "text" must be a string of at most 5 bytes or null; it has 6)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"list":[1,2,3,4,5]})"),
            R"(the member "list" must be an array of at most 3 elements or null; it has 5)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"list":[1,null,true]})"),
            R"(the member "list[2]" must be a number; it is true)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"two":[1]})"),
            R"(the member "two" must be base64 of 2 bytes or null; it has 1)");
  EXPECT_EQ(diagnosis_of<anything>(R"({"yes":0})"),
            R"(the member "yes" must be true or false or null; it is 0)");
}

TEST(decoder, shortens_what_it_quotes_and_cuts_no_character) {
  const std::string huge = R"({"x":")" + repeat("ü", 1000) + R"(","y":1})";
  const std::string said = diagnosis_of<point>(huge);
  EXPECT_EQ(said.substr(0, 42), R"(the member "x" must be a number; it is "ü)");
  EXPECT_TRUE(said.ends_with("ü...")) << said;
  EXPECT_LT(said.size(), 120U);
  for (std::size_t capacity = 0; capacity < said.size(); ++capacity) {
    point into;
    decoder::diagnosis why;
    ASSERT_FALSE(decoder_of<point>().decode(huge, &into, &why));
    std::string words(capacity, '\0');
    const std::string cut{why.text(words)};
    EXPECT_LE(cut.size(), capacity);
    EXPECT_TRUE(said.starts_with(cut)) << cut;
    std::string quoted{cut};
    std::replace(quoted.begin(), quoted.end(), '"', ' ');
    EXPECT_TRUE(tests::is_valid('"' + quoted + '"')) << cut; // still UTF-8
  }
}

TEST(decoder, begins_with_the_default_but_empties_what_is_missing) {
  const auto p = decoded<preset>(R"({"other":1})");
  EXPECT_EQ(p.not_listed, 9);
  EXPECT_FALSE(p.maybe.has_value());
  EXPECT_EQ(decoded<preset>(R"({"maybe":0,"other":1})").maybe, 0);
}

// ---- everything ----

std::string everything_with(std::string_view counted) {
  return concat({R"({"numbers":{"yes":true,"i8":1,"i16":2,"i32":3,"i64":4,"u8":5,"u16":6,"u32":7,"u64":8,)"
                 R"("f":9,"d":10,"g":1},"serial":"9007199254740993","ids":["1",2],"the \"text\"":"a\tb",)"
                 R"("where":{"x":1,"y":2},"covariance":[1,0,0.5],"a matrix of two rows":[[1,2],[3,4]],)"
                 R"("path":[{"x":1,"y":2},{"x":3,"y":4}],"names":["left","right"],"holes":[null,7],)",
                 counted, "}"});
}

TEST(decoder, sets_counts_by_the_arrays_whatever_the_text_says) {
  for (const std::string_view text : {R"("count":99,"ranges":[1,2,3],"intensities":[3,4,5],"ü":[1])",
                                      R"("ranges":[1,2,3],"count":0,"intensities":[3,4,5],"ü":[1])",
                                      R"("intensities":[3,4,5],"ranges":[1,2,3],"ü":[1],"count":-7)"}) {
    const auto e = decoded<everything>(everything_with(text));
    EXPECT_EQ(e.count, 3);
    EXPECT_EQ(e.intensities[2], 5);
    EXPECT_EQ(e.much_count, 1);
  }
  EXPECT_EQ(refused<everything>(everything_with(R"("ranges":[],"intensities":[],"count":128,"ü":[])")).code,
            errc::out_of_range);
  EXPECT_EQ(refused<everything>(everything_with(R"("ranges":[],"intensities":[],"ü":[])")),
            (error{errc::missing_member, 34})); // what is inside of others counts, too
}

TEST(decoder, refuses_counted_arrays_that_are_too_long_to_hold_or_to_count) {
  EXPECT_EQ(refused<everything>(everything_with(R"("ranges":[1,2,3,4,5],"intensities":[],"count":0,"ü":[])")),
            (error{errc::too_long, 5, 4}));
  const auto much = [](std::size_t count) {
    return everything_with(
        concat({R"("ranges":[],"intensities":[],"count":0,"ü":[0)", repeat(",0", count - 1), "]"}));
  };
  EXPECT_EQ(decoded<everything>(much(255)).much_count, 255);
  EXPECT_EQ(refused<everything>(much(256)), (error{errc::too_long, 256, 255}));
}

TEST(decoder, refuses_arrays_of_one_count_that_are_not_equally_long) {
  const std::string text = everything_with(R"("ranges":[1,2],"intensities":[1],"count":2,"ü":[])");
  EXPECT_EQ(refused<everything>(text), (error{errc::too_long, 1, 2}));
  EXPECT_EQ(diagnosis_of<everything>(text),
            R"(the member "intensities" must be as long as the array that is counted with it, 2; it has 1)");
  EXPECT_EQ(refused<everything>(everything_with(R"("intensities":[1],"count":2,"ranges":[1,2],"ü":[])")),
            (error{errc::too_long, 2, 1}));
}

// ---- at random ----

class random_everything {
 public:
  explicit random_everything(std::mt19937_64& random) : random_{random} {}

  everything next() {
    everything e;
    numbers& n = e.numbers;
    n.yes = coin();
    set(n.i8, n.i16, n.i32, n.i64, n.u8, n.u16, n.u32, n.u64, e.serial, e.ids[0], e.ids[1]);
    n.f = static_cast<float>(real());
    n.d = real();
    n.g = static_cast<gear>(integer<std::int8_t>());
    e.text = text<12>();
    e.where = place();
    for (double& x : e.covariance) x = real();
    for (auto& row : e.matrix)
      for (float& x : row) x = static_cast<float>(real());
    fill(e.path, [this] { return place(); });
    fill(e.names, [this] { return text<8>(); });
    if (coin()) e.real = std::isfinite(real()) ? 0.5 : -1e-9; // what is null comes back as nothing
    if (coin()) e.goal = place();
    if (coin()) fill(e.list.emplace(), [this] { return integer<std::int32_t>(); });
    for (auto& x : e.holes)
      if (coin()) x = integer<std::int32_t>();
    e.count = static_cast<std::int8_t>(random_() % 5);
    for (int i = 0; i < e.count; ++i) {
      e.ranges[i] = static_cast<float>(real());
      e.intensities[i] = integer<std::uint16_t>();
    }
    e.much_count = static_cast<std::uint8_t>(coin() ? 0 : random_() % 256);
    for (int i = 0; i < e.much_count; ++i) e.much[i] = real();
    const auto byte = [this] { return integer<std::uint8_t>(); };
    if (coin()) fill(e.bytes.emplace(), byte);
    if (coin()) {
      for (std::byte& x : e.raw.emplace()) x = std::byte{byte()};
    }
    if (coin()) fill(e.plain.emplace(), byte);
    if (coin()) {
      for (auto& row : e.rows.emplace()) fill(row, [&] { return std::byte{byte()}; });
    }
    return e;
  }

 private:
  bool coin() { return random_() % 2 == 0; }
  point place() { return {real(), real()}; }
  template <class Integer>
  Integer integer() {
    return static_cast<Integer>(static_cast<std::uint64_t>(random_()) >> random_() % 64);
  }
  double real() {
    switch (random_() % 6) {
    case 0: return std::bit_cast<double>(random_());
    case 1: return static_cast<double>(static_cast<std::int64_t>(random_()) >> random_() % 64);
    case 2: return -0.0;
    case 3: return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(random_())));
    default: return static_cast<double>(static_cast<std::int64_t>(random_() % 2'000'001) - 1'000'000) / 1000;
    }
  }
  template <class... Integers>
  void set(Integers&... all) {
    ((all = integer<Integers>()), ...);
  }
  template <class Array, class Make>
  void fill(Array& into, Make make) {
    while (coin() && into.push_back(make())) {
    }
  }
  template <std::size_t Bytes>
  fixed_string<Bytes> text() {
    static constexpr std::string_view pieces[] = {"a",      "\"",         "\\",   "\n", "/",
                                                  "\u00e9", "\U0001F600", "\x01", "bc"};
    std::string all;
    for (std::size_t i = random_() % 8; i > 0; --i) all += pieces[random_() % std::size(pieces)];
    fixed_string<Bytes> s;
    if (!s.assign(all)) (void)s.assign("too long");
    return s;
  }

  std::mt19937_64& random_;
};

TEST(decoder, reads_bytes_from_base64_and_from_numbers) {
  for (const std::string_view two : {"[1,2]", R"("AQI=")", R"("\u0041QI\u003d")"})
    EXPECT_EQ(decoded<anything>(member("two", two)).two->at(1), 2) << two;
  EXPECT_EQ(refused<anything>(R"({"two":"AQ=="})"), (error{errc::too_long, 1, 2}));
  EXPECT_EQ(diagnosis_of<anything>(R"({"two":"AQID"})"),
            R"(the member "two" must be base64 of 2 bytes or null; it has 3)");
  EXPECT_EQ(refused<anything>(R"({"two":"A-I="})"), (error{errc::wrong_type, 7}));
  EXPECT_EQ(diagnosis_of<anything>(R"({"two":"A-I="})"),
            R"(the member "two" must be base64 of 2 bytes or null; it is "A-I=")");
}

TEST(decoder, reads_back_what_the_encoder_writes) {
  tests::seeded random;
  random_everything source{random};
  for (int i = 0; i < 2000; ++i) {
    const everything e = source.next();
    const std::string text = encoded(e);
    ASSERT_EQ(encoded(decoded<everything>(text)), text);
  }
}

TEST(decoder, reads_the_same_however_a_text_is_spelt) {
  tests::seeded random;
  random_everything source{random};
  tests::respelling other{random, 0};
  for (int i = 0; i < 2000; ++i) {
    const std::string text = encoded(source.next());
    const std::string respelt = other.text(root(text));
    ASSERT_EQ(encoded(decoded<everything>(respelt)), text) << respelt;
  }
}

// Errors, too, with their places: decode() compares.
TEST(decoder, agrees_with_a_plain_reference_on_texts_with_faults) {
  tests::seeded random;
  random_everything source{random};
  std::array<int, static_cast<std::size_t>(errc::misuse) + 1> seen{};
  for (int i = 0; i < 20'000; ++i) {
    everything e = source.next();
    e.much_count = static_cast<std::uint8_t>(e.much_count % 4);
    tests::respelling faulty{random, 100};
    const std::string text = faulty.text(root(encoded(e)));
    everything into;
    const status verdict = decode(text, into);
    ASSERT_FALSE(HasFailure()) << text;
    if (!verdict) ++seen[static_cast<std::size_t>(verdict.code())];
  }
  for (const errc code : {errc::not_an_object, errc::missing_member, errc::duplicate_member, errc::wrong_type,
                          errc::out_of_range, errc::too_long}) {
    EXPECT_GT(seen[static_cast<std::size_t>(code)], 0) << error{code}.name();
  }
}

TEST(decoder, stays_inside_texts_that_nobody_validated) {
  const std::string text = everything_with(R"("ranges":[1,2],"intensities":[3,4],"count":2,"ü":[])");
  everything into;
  for (std::size_t bytes = 0; bytes < text.size(); ++bytes) {
    const auto exact = std::make_unique<char[]>(bytes);
    text.copy(exact.get(), bytes);
    (void)decoder_of<everything>().decode({exact.get(), bytes}, &into);
    for (const char c : {'"', '{', ']', '\\', '0', '\0'}) {
      if (bytes == 0) continue;
      exact[bytes - 1] = c;
      (void)decoder_of<everything>().decode({exact.get(), bytes}, &into);
    }
  }
}

// ---- schemas made by hand ----

constexpr std::size_t wide_count = decoder::members_max;
struct wide {
  std::array<std::int32_t, wide_count + 1> values;
};

template <std::size_t I>
const void* value_address(const void* object) noexcept {
  return static_cast<const char*>(object) + 4 * I;
}
// A table, because a pack of a thousand descriptions takes a minute to compile.
constexpr auto value_addresses = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array{&value_address<I>...};
}
(std::make_index_sequence<wide_count + 1>{});

// `count` integers with the names m0, m1, ...
class wide_schema {
 public:
  explicit wide_schema(std::size_t count) {
    for (std::size_t i = 0; i <= wide_count; ++i) {
      names_[i] = "m" + std::to_string(i);
      members_[i] = {.name = names_[i], .type = &integer_, .address = value_addresses[i]};
    }
    schema_.members = std::span{members_}.first(count);
  }
  const schema_description& description() const { return schema_; }

 private:
  static void set_default(void* storage) noexcept { new (storage) wide{}; }

  const value_description integer_{.kind = value_kind::int32, .bytes = 4};
  std::array<std::string, wide_count + 1> names_;
  std::array<member_description, wide_count + 1> members_;
  schema_description schema_{.type_name = {},
                             .bytes = sizeof(wide),
                             .alignment = alignof(wide),
                             .members = {},
                             .set_default = set_default,
                             .decodable = true};
};

TEST(decoder, knows_each_of_very_many_members) {
  tests::seeded random;
  for (const std::size_t count : {63u, 64u, 65u, 100u, 128u, 1024u}) {
    const wide_schema schema{count};
    const decoder d = decoder::compile(schema.description()).value();
    std::vector<std::size_t> order(count);
    for (std::size_t i = 0; i < count; ++i) order[i] = i;
    for (int round = 0; round < 4; ++round) {
      const auto text_without = [&](std::size_t missing, std::size_t twice) {
        std::string all = "{";
        for (const std::size_t i : order) {
          if (i == missing) continue;
          const std::string m = "\"m" + std::to_string(i) + "\":" + std::to_string(i) + ",";
          all += m + (i == twice ? m : "");
        }
        return all + "\"m\":0}";
      };
      auto w = std::make_unique<wide>();
      ASSERT_TRUE(d.decode(text_without(count, count), w.get()));
      for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(w->values[i], static_cast<int>(i));
      for (const std::size_t i : {std::size_t{0}, std::size_t{62}, count / 2, count - 2, count - 1}) {
        EXPECT_EQ(d.decode(text_without(i, count), w.get()).error(),
                  (error{errc::missing_member, static_cast<std::int64_t>(i + 1)}));
        EXPECT_EQ(d.decode(text_without(count, i), w.get()).code(), errc::duplicate_member);
      }
      std::shuffle(order.begin(), order.end(), random);
    }
  }
}

TEST(decoder, refuses_schemas_with_too_many_members) {
  EXPECT_TRUE(decoder::compile(wide_schema{wide_count}.description()));
  const auto refused = decoder::compile(wide_schema{wide_count + 1}.description());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), (error{errc::bad_argument, wide_count + 1, wide_count}));
}

TEST(decoder, reads_as_deep_as_a_schema_may_nest_and_refuses_deeper_ones) {
  const tests::nested_arrays arrays{decoder::depth_max};
  const decoder d = decoder::compile(arrays.schema(decoder::depth_max - 1)).value();
  const auto text = [](std::size_t depth) {
    return concat({"{\"a\":", repeat("[", depth), "77", repeat("]", depth), "}"});
  };
  std::uint8_t byte = 0;
  EXPECT_TRUE(d.decode(text(decoder::depth_max - 1), &byte));
  EXPECT_EQ(byte, 77);
  EXPECT_EQ(d.decode(text(decoder::depth_max), &byte).code(), errc::wrong_type);
  EXPECT_EQ(d.decode(text(decoder::depth_max - 2), &byte).code(), errc::wrong_type);
  const auto refused = decoder::compile(arrays.schema(decoder::depth_max));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), (error{errc::bad_argument, decoder::depth_max + 1, decoder::depth_max}));
}

TEST(decoder, refuses_schemas_of_structs_that_are_too_large) {
  schema_description huge = describe<point>();
  huge.bytes = decoder::bytes_limit + 1;
  EXPECT_EQ(decoder::compile(huge).error(),
            (error{errc::bad_argument, decoder::bytes_limit + 1, decoder::bytes_limit}));
}

TEST(schema, says_what_cannot_be_read) {
  static_assert(describe<everything>().decodable);
  static_assert(describe<anything>().decodable);
  static_assert(!describe<constant>().decodable);
  static_assert(!describe<with_constant>().decodable);
  static_assert(!describe<no_default>().decodable);
  static_assert(!describe<maybe_no_default>().decodable);
  static_assert(!describe<constant_count>().decodable);
  EXPECT_EQ(decoder::compile(describe<constant>()).error(), error{errc::bad_argument});
  EXPECT_EQ(decoder::compile(describe<no_default>()).error(), error{errc::bad_argument});
  EXPECT_TRUE(encoder::compile(describe<constant_count>()));
}

TEST(decoder, can_be_moved) {
  decoder a = decoder::compile(describe<point>()).value();
  decoder b = std::move(a);
  decoder c = decoder::compile(describe<ros::time>()).value();
  c = std::move(b);
  point p;
  EXPECT_TRUE(c.decode(R"({"x":5,"y":6})", &p));
  EXPECT_EQ(p.y, 6);
}

} // namespace
} // namespace decoder_test
} // namespace rowe::json
