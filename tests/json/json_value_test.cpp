// SPDX-License-Identifier: Apache-2.0
// What was received, read in place: paths, types, members and elements, and what is said where it fails.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <rowe/json_value.hpp>

#include "decodable.hpp"
#include "texts.hpp"

namespace json_value_test {
enum class gait : std::int8_t { back = -1, stand, walk };
}
template <>
inline constexpr auto rowe::names<json_value_test::gait> =
    rowe::enumerators<json_value_test::gait::back, json_value_test::gait::stand,
                      rowe::enumerator<json_value_test::gait::walk, "w\u00e4lk">>{};

namespace json_value_test {
namespace {

using namespace std::chrono;
using rowe::errc;
using rowe::fixed_string;
using rowe::json_kind;
using rowe::json_result;
using rowe::json_value;
using rowe::tests::repeat;

json_value of(std::string_view text) { return json_value::parse(text).value(); }

// The error of reading a T at `path`, in words; empty where there is none.
template <class T>
std::string refused(std::string_view text, std::string_view path = {}) {
  const auto read = of(text).get<T>(path);
  return read ? std::string{} : read.error().message();
}
template <class T>
errc code(std::string_view text, std::string_view path = {}) {
  return of(text).get<T>(path).code();
}

constexpr std::string_view robots =
    R"( {"robots":[ {"name":"a"} , {"name":"b","pose":{"x":1.5,"":0,"a.b":[[7]]}} ],"n":null} )";

// ---- paths ----

TEST(json_value, finds_what_stands_at_a_path) {
  const json_value v = of(robots);
  EXPECT_EQ(v.get<double>("robots[1].pose.x").value(), 1.5);
  EXPECT_EQ(v.get<std::string_view>("robots[0].name").value(), "a");
  EXPECT_EQ(v.find("robots[1].pose")->text(), R"({"x":1.5,"":0,"a.b":[[7]]})");
  EXPECT_EQ(v.find("robots[1].pose")->get<double>("x").value(), 1.5);
  EXPECT_EQ(v.find("robots")->get<json_value>("[0]").value().text(), R"({"name":"a"})");
  EXPECT_EQ(v.find("")->text(), v.text());
}

TEST(json_value, finds_names_that_must_be_quoted) {
  const json_value v = of(robots);
  EXPECT_EQ(v.get<int>("robots[1].pose['']").value(), 0);
  EXPECT_EQ(v.get<int>("['robots'][1][\"pose\"]['a.b'][0][0]").value(), 7);
  EXPECT_EQ(of(R"({"it's":1})").get<int>("[\"it's\"]").value(), 1);
}

TEST(json_value, finds_nothing_where_nothing_is) {
  const json_value v = of(robots);
  for (const std::string_view path :
       {"robot", "robots[2]", "robots[18446744073709551616]", "robots.name", "n.x", "n[0]",
        "robots[0].name.x", "robots[1].pose['a.b'][0][1]", "", "."}) {
    EXPECT_EQ(v.find(path).has_value(), path.empty()) << path;
  }
  EXPECT_FALSE(of("[]").find("[0]"));
  EXPECT_FALSE(of("{}").find("a"));
}

TEST(json_value, says_where_a_path_is_wrong_whatever_the_text) {
  const std::vector<std::pair<std::string_view, int>> wrong{
      {".a", 0},    {"a.", 2},   {"a..b", 2},  {"a[", 2},    {"a[]", 2},      {"a[1", 3},   {"a[1]b", 4},
      {"a[-1]", 2}, {"a[b]", 2}, {"a['b]", 5}, {"a['b'", 5}, {"a['b'.c]", 5}, {"a.[0]", 2}, {"[", 1}};
  for (const auto& [path, at] : wrong) {
    for (const std::string_view text : {R"({"a":{"b":1}})", R"({"a":[1]})", "7"}) {
      const auto read = of(text).get<int>(path);
      ASSERT_FALSE(read) << path;
      EXPECT_EQ(read.code(), errc::bad_argument) << path << ' ' << text;
      EXPECT_EQ(read.error().reason.value, at) << path << ' ' << text;
      EXPECT_EQ(read.error().path.view(), path);
      EXPECT_FALSE(of(text).find(path)) << path;
      EXPECT_EQ(of(text).get<std::optional<int>>(path).code(), errc::bad_argument) << path;
    }
  }
  EXPECT_EQ(refused<int>("{}", "a..b"),
            "the path \"a..b\" is wrong at byte 2: NAME, .NAME, [INDEX] or ['NAME'] is wanted");
}

TEST(json_value, compares_names_by_what_they_mean) {
  EXPECT_EQ(of(R"({"\u0061\/\ud83d\ude00":1})").get<int>("a/\xf0\x9f\x98\x80").value(), 1);
  EXPECT_EQ(of(R"({"a\\b":1})").get<int>("a\\b").value(), 1);
  EXPECT_EQ(code<int>(R"({"a\\b":1})", "a\\\\b"), errc::missing_member);
  EXPECT_EQ(of(R"({"a\u0000b":1})").get<int>(std::string_view{"a\0b", 3}).value(), 1);
}

TEST(json_value, takes_the_first_of_members_with_one_name) {
  EXPECT_EQ(of(R"({"a":1,"a":2,"\u0061":3})").get<int>("a").value(), 1);
  EXPECT_EQ(of(R"({"a":{"b":1},"a":{"c":2}})").get<int>("a.c").code(), errc::missing_member);
}

TEST(json_value, is_not_misled_by_brackets_and_quotes_in_strings) {
  const json_value v = of(R"({"a":"}\",\"b\":1","c":["]","\\"],"b":2})");
  EXPECT_EQ(v.get<int>("b").value(), 2);
  EXPECT_EQ(v.get<std::string>("a").value(), "}\",\"b\":1");
  EXPECT_EQ(v.get<std::string>("c[1]").value(), "\\");
}

TEST(json_value, follows_a_path_as_deep_as_texts_may_nest) {
  const std::string text = repeat("[", 63) + "{\"x\":5}" + repeat("]", 63);
  EXPECT_EQ(of(text).get<int>(repeat("[0]", 63) + ".x").value(), 5);
  const std::string objects = repeat("{\"a\":", 64) + "true" + repeat("}", 64);
  std::string path = "a";
  for (int i = 1; i < 64; ++i) path += ".a";
  EXPECT_TRUE(of(objects).get<bool>(path).value());
  const auto beyond = of(objects).get<bool>(path + ".a.and.what.is.longer.than.an.error.keeps.of.it");
  EXPECT_EQ(beyond.code(), errc::wrong_type);
  EXPECT_TRUE(beyond.error().path.view().starts_with("a.a."));
}

// ---- types ----

TEST(json_value, reads_integers_exactly) {
  EXPECT_EQ(of("9007199254740993").get<std::int64_t>().value(), 9007199254740993);
  EXPECT_EQ(of("-9223372036854775808").get<std::int64_t>().value(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(of("18446744073709551615").get<std::uint64_t>().value(), ~std::uint64_t{0});
  EXPECT_EQ(of("-128").get<std::int8_t>().value(), -128);
  EXPECT_EQ(of("-0").get<unsigned>().value(), 0U);
  EXPECT_EQ(of("-1.0e0").get<std::int32_t>().value(), -1);
}

TEST(json_value, refuses_numbers_that_do_not_fit) {
  for (const std::string_view text : {"256", "-1", "1e300"})
    EXPECT_EQ(code<std::uint8_t>(text), errc::out_of_range);
  EXPECT_EQ(code<std::int8_t>("-129"), errc::out_of_range);
  for (const std::string_view text : {"9223372036854775808", "-9223372036854775809"})
    EXPECT_EQ(code<std::int64_t>(text), errc::out_of_range);
  EXPECT_EQ(code<std::uint64_t>("18446744073709551616"), errc::out_of_range);
  EXPECT_EQ(code<float>("3.5e38"), errc::out_of_range);
  EXPECT_EQ(code<int>("5e-1"), errc::wrong_type);
  EXPECT_EQ(refused<std::uint8_t>(R"({"a":-1})", "a"),
            "the member \"a\" must be a whole number from 0 to 255; it is -1");
}

TEST(json_value, reads_reals_rounded_once_and_zeros_with_their_sign) {
  EXPECT_EQ(of("0.1").get<double>().value(), 0.1);
  EXPECT_EQ(of("0.1").get<float>().value(), 0.1F);
  EXPECT_TRUE(std::signbit(of("-0.0").get<double>().value()));
  // A loop that compares with a NaN lets everything pass, so null is none.
  EXPECT_EQ(code<double>("null"), errc::wrong_type);
  EXPECT_EQ(code<double>("\"1\""), errc::wrong_type);
}

enum class mode : std::uint8_t { idle, drive };

TEST(json_value, reads_booleans_and_enums) {
  EXPECT_TRUE(of("true").get<bool>().value());
  EXPECT_FALSE(of("false").get<bool>().value());
  EXPECT_EQ(code<bool>("1"), errc::wrong_type);
  EXPECT_EQ(of("1").get<mode>().value(), mode::drive);
  EXPECT_EQ(code<mode>("256"), errc::out_of_range);
  EXPECT_EQ(code<mode>("\"drive\""), errc::wrong_type);
}

TEST(json_value, reads_enums_by_name) {
  EXPECT_EQ(of(R"("back")").get<gait>().value(), gait::back);
  EXPECT_EQ(of("\"w\\u00e4lk\"").get<gait>().value(), gait::walk); // escaped
  EXPECT_EQ(of("-1.0").get<gait>().value(), gait::back);
  EXPECT_EQ(of("null").get<std::optional<gait>>().value(), std::nullopt);
}

TEST(json_value, refuses_what_is_no_name_of_an_enum_and_no_number_of_one) {
  EXPECT_EQ(code<gait>("2"), errc::out_of_range);
  EXPECT_EQ(code<gait>("200"), errc::out_of_range);
  EXPECT_EQ(code<gait>("true"), errc::wrong_type);
  EXPECT_EQ(code<gait>("0.5"), errc::wrong_type);
  EXPECT_EQ(code<gait>(R"("")"), errc::out_of_range);
  EXPECT_EQ(refused<gait>(R"({"gait":"trot"})", "gait"),
            "the member \"gait\" must be \"back\", \"stand\" or \"w\u00e4lk\"; it is \"trot\"");
}

TEST(json_value, reads_durations_and_times_as_their_count) {
  EXPECT_EQ(of("1500").get<milliseconds>().value(), 1500ms);
  EXPECT_EQ((of("0.25").get<duration<double>>().value()), 250ms);
  EXPECT_EQ(of("-3").get<sys_time<seconds>>().value().time_since_epoch(), -3s);
  EXPECT_EQ(code<nanoseconds>("1e19"), errc::out_of_range);
  EXPECT_EQ(code<seconds>("1.5"), errc::wrong_type);
  EXPECT_EQ(code<seconds>(R"("1")"), errc::wrong_type);
}

TEST(json_value, reads_strings_in_place_or_copied) {
  const std::string text = R"({"a":"odom","e":"\u00e4\n\ud83d\ude00"})";
  const json_value v = of(text);
  const std::string_view odom = v.get<std::string_view>("a").value();
  EXPECT_EQ(odom, "odom");
  EXPECT_EQ(odom.data(), text.data() + 6);
  EXPECT_EQ(refused<std::string_view>(text, "e"),
            R"(the member "e" must be a string without escapes; it is "\u00e4\n\ud83d\ude00")");
  char scratch[7];
  const std::string_view copied = v.get<std::string_view>("e", scratch).value();
  EXPECT_EQ(copied, "\xc3\xa4\n\xf0\x9f\x98\x80");
  EXPECT_EQ(copied.data(), scratch);
  EXPECT_EQ(v.get<std::string_view>("a", std::span<char>{}).value().data(), odom.data());
  EXPECT_EQ(v.get<std::string>("e").value(), copied);
  EXPECT_EQ(v.get<fixed_string<7>>("e").value(), copied);
  EXPECT_EQ(v.get<fixed_string<4>>("a").value(), odom);
  EXPECT_EQ(v.get<std::string>("b").code(), errc::missing_member);
  EXPECT_EQ(code<fixed_string<4>>("7"), errc::wrong_type);
}

TEST(json_value, says_how_long_a_string_is_that_does_not_fit) {
  const json_value v = of(R"({"a":"odom","e":"\u00e4\n"})");
  const auto plain = v.get<fixed_string<3>>("a");
  EXPECT_EQ(plain.error().reason, (rowe::error{errc::too_long, 4, 3}));
  EXPECT_EQ(plain.error().message(), "the member \"a\" must be a string of at most 3 bytes; it has 4");
  EXPECT_EQ(v.get<fixed_string<2>>("e").error().reason, (rowe::error{errc::too_long, 3, 2}));
  char scratch[2];
  EXPECT_EQ(v.get<std::string_view>("e", scratch).error().reason, (rowe::error{errc::too_long, 3, 2}));
}

TEST(json_value, reads_an_optional_where_nothing_or_null_stands) {
  const json_value v = of(R"({"a":null,"b":2,"c":"x","list":[1]})");
  EXPECT_EQ(v.get<std::optional<int>>("a").value(), std::nullopt);
  EXPECT_EQ(v.get<std::optional<int>>("z").value(), std::nullopt);
  EXPECT_EQ(v.get<std::optional<int>>("z.deep[3]").value(), std::nullopt);
  EXPECT_EQ(v.get<std::optional<int>>("list[1]").value(), std::nullopt);
  EXPECT_EQ(v.get<std::optional<int>>("b").value(), 2);
  EXPECT_EQ(v.get<std::optional<int>>("c").code(), errc::wrong_type);
  EXPECT_EQ(v.get<std::optional<int>>("c.deep").code(), errc::wrong_type);
  EXPECT_EQ(v.get<std::optional<std::string_view>>("c").value(), "x");
}

static_assert(!rowe::json_readable<char> && !rowe::json_readable<long double> && !rowe::json_readable<int*> &&
              !rowe::json_readable<std::string> && !rowe::json_readable<rowe::tests::point>);
static_assert(sizeof(json_value) == sizeof(std::string_view));
static_assert(std::is_trivially_copyable_v<json_value>);

// ---- what is said ----

TEST(json_value, says_what_is_missing_and_what_was_wanted) {
  const auto read = of(robots).get<double>("robots[1].pose.y");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.code(), errc::missing_member);
  EXPECT_EQ(read.error().path.view(), "robots[1].pose.y");
  EXPECT_EQ(read.error().wanted.view(), "a number");
  EXPECT_TRUE(read.error().found.empty());
  EXPECT_EQ(read.error().message(), "the member \"robots[1].pose.y\" is missing; a number is wanted");
  EXPECT_EQ(refused<bool>(robots, "robot[1].x"), "the member \"robot\" is missing; an array is wanted");
  EXPECT_EQ(refused<bool>(robots, "robots[2]"),
            "the element \"robots[2]\" is missing; true or false is wanted, and the array has 2");
}

TEST(json_value, says_what_is_there_instead) {
  EXPECT_EQ(refused<double>(robots, "robots[0].name"),
            "the member \"robots[0].name\" must be a number; it is \"a\"");
  EXPECT_EQ(refused<double>(robots, "robots[0].name.x"),
            "the member \"robots[0].name\" must be an object; it is \"a\"");
  EXPECT_EQ(refused<double>(robots, "robots.x"),
            "the member \"robots\" must be an object; it is "
            "[ {\"name\":\"a\"} , {\"name\":\"b\",\"pose\":{\"x\":1.5,\"\":...");
  EXPECT_EQ(refused<double>("[1]", "x"), "an object is wanted; it is [1]");
  EXPECT_EQ(refused<json_value>("{}", "x"), "the member \"x\" is missing; a value is wanted");
}

TEST(json_value, writes_an_error_on_one_line_and_cuts_it_between_characters) {
  EXPECT_EQ(refused<double>("[1,\n\t2]"), "a number is wanted; it is [1,  2]");
  const auto read = of("\"\u00e4\u00e4\"").get<double>();
  char buffer[28]; // ends within the first character of two bytes
  EXPECT_EQ(read.error().message(buffer), "a number is wanted; it is \"");
  char larger[29];
  EXPECT_EQ(read.error().message(larger), "a number is wanted; it is \"\u00e4");
}

TEST(json_value, throws_what_it_says_where_a_value_is_required) {
  try {
    (void)of("{}").get<double>("result").value();
    FAIL() << "nothing was thrown";
  } catch (const rowe::bad_result& reason) {
    EXPECT_STREQ(reason.what(), "the member \"result\" is missing; a number is wanted");
    EXPECT_EQ(reason.error().code, errc::missing_member);
  }
}

// ---- members and elements ----

TEST(json_value, walks_members_and_elements_in_order) {
  std::string seen;
  for (const auto [name, value] : of(R"({ "a" : 1 , "\u0062":[2], "a":{} })").members()) {
    seen.append(name.text()).append(value.text()).append(";");
  }
  EXPECT_EQ(seen, R"("a"1;"\u0062"[2];"a"{};)");
  seen.clear();
  for (const json_value value : of("[ 1 ,[2,3],\"]\", null]").elements()) seen.append(value.text()) += ';';
  EXPECT_EQ(seen, "1;[2,3];\"]\";null;");
}

TEST(json_value, has_no_members_or_elements_but_of_its_kind) {
  for (const std::string_view text : {"{}", " {  } ", "[]", "[1]", "7", "\"{\"", "null"}) {
    EXPECT_EQ(of(text).members().begin(), of(text).members().end()) << text;
  }
  for (const std::string_view text : {"{}", "[ ]", "{\"a\":1}", "7", "\"[1]\"", "null"}) {
    EXPECT_EQ(of(text).elements().begin(), of(text).elements().end()) << text;
  }
  EXPECT_EQ(json_value{}.kind(), json_kind::null);
  EXPECT_FALSE(json_value{}.find("a"));
}

TEST(json_value, knows_kinds_and_what_strings_say) {
  const std::vector<std::pair<std::string_view, json_kind>> kinds{
      {" {} ", json_kind::object},     {"[]", json_kind::array}, {"\"\"", json_kind::string},
      {"-1", json_kind::number},       {"0", json_kind::number}, {"true", json_kind::boolean},
      {"\tfalse", json_kind::boolean}, {"null", json_kind::null}};
  for (const auto& [text, kind] : kinds) EXPECT_EQ(of(text).kind(), kind) << text;
  EXPECT_TRUE(of(R"("\u0061b")").says("ab"));
  EXPECT_FALSE(of(R"("a")").says("ab"));
  EXPECT_FALSE(of("1").says("1"));
}

// ---- texts that were not received ----

TEST(json_value, checks_texts_that_were_not_received) {
  EXPECT_EQ(json_value::parse("{\"a\":1,}").error(), (rowe::error{errc::malformed, 7}));
  EXPECT_EQ(json_value::parse("").error(), (rowe::error{errc::malformed, 0}));
  EXPECT_EQ(json_value::parse("1 2").error(), (rowe::error{errc::malformed, 2}));
  EXPECT_EQ(json_value::parse("1e999").error(), (rowe::error{errc::malformed, 0}));
  EXPECT_EQ(json_value::parse(repeat("[", 65)).error(), (rowe::error{errc::too_deep, 64, 64}));
  EXPECT_EQ(json_value::parse(" \n7\t").value().text(), "7");
  EXPECT_EQ(json_value::parse("[[]]", 1).error(), (rowe::error{errc::too_deep, 1, 1}));
  EXPECT_TRUE(json_value::parse(repeat("[", 1024) + repeat("]", 1024), 1024));
  EXPECT_EQ(json_value::parse("7", 1025).error(), (rowe::error{errc::bad_argument, 1025, 1024}));
}

// ---- by a schema ----

using rowe::tests::point;

TEST(json_value, reads_a_struct_by_its_schema) {
  const json_value v = of(R"({"poses":[{"x":1,"y":2,"z":3},{"y":-0.5,"x":4}]})");
  const auto read = v.as<point>("poses[1]");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->x, 4);
  EXPECT_EQ(read->y, -0.5);
  EXPECT_EQ(v.find("poses[0]")->as<point>().value().y, 2);
}

TEST(json_value, says_which_member_does_not_match_the_schema) {
  const json_value v = of(R"({"a":[{"x":1,"y":"2"}],"b":{"x":1},"c":{"x":1,"\u0078":2,"y":0},"d":[]})");
  const auto wrong = v.as<point>("a[0]");
  EXPECT_EQ(wrong.code(), errc::wrong_type);
  EXPECT_EQ(wrong.error().path.view(), "a[0].y");
  EXPECT_EQ(wrong.error().wanted.view(), "a number");
  EXPECT_EQ(wrong.error().found.view(), "\"2\"");
  EXPECT_EQ(wrong.error().message(), "the member \"a[0].y\" must be a number; it is \"2\"");
  EXPECT_EQ(v.as<point>("b").error().message(), "the member \"b.y\" is missing; a number is wanted");
  EXPECT_EQ(v.as<point>("c").error().message(), "the member \"c.x\" occurs twice");
  EXPECT_EQ(v.as<point>("d").error().message(), "the member \"d\" must be an object; it is []");
  EXPECT_EQ(v.as<point>("d").code(), errc::wrong_type);
  EXPECT_EQ(v.as<point>("e").error().message(), "the member \"e\" is missing; an object is wanted");
  EXPECT_EQ(of("7").as<point>().error().message(), "an object is wanted; it is 7");
}

TEST(json_value, says_of_a_schema_how_much_a_member_holds) {
  using rowe::tests::anything;
  EXPECT_EQ(of(R"({"m":{"text":"123456"}})").as<anything>("m").error().message(),
            "the member \"m.text\" must be a string of at most 5 bytes or null; it has 6");
  EXPECT_EQ(of(R"({"two":[1,300]})").as<anything>().error().message(),
            "the element \"two[1]\" must be a whole number from 0 to 255; it is 300");
}

} // namespace
} // namespace json_value_test
