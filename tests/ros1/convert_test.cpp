// SPDX-License-Identifier: Apache-2.0
#include "tools/ros1/convert.hpp"

#include <gtest/gtest.h>

#include <random>

namespace rowe::ros1 {
namespace convert_test {
namespace {

using namespace std::string_literals;

message_type_ptr type_of(const std::string& text) {
  std::string why;
  auto type = read_message("a/T", sections_of("a/T", text), why);
  EXPECT_TRUE(type) << why;
  return type;
}

const std::string everything =
    "bool b\nint8 i8\nuint8 u8\nint16 i16\nuint16 u16\nint32 i32\nuint32 u32\nint64 i64\nuint64 u64\n"
    "float32 f32\nfloat64 f64\nstring s\ntime t\nduration d\nbyte y\nchar c\n"
    "uint8[] bytes\nuint8[3] three\nchar[] letters\nint8[] small\nfloat64[2] pair\nP[] points\nstring[] "
    "names\n"
    "================================================================================\n"
    "MSG: a/P\nfloat64 x\nE e\n"
    "================================================================================\n"
    "MSG: a/E\n";

std::string json_of(const message_type& type, std::string_view bytes, std::size_t bytes_max = 60000) {
  std::string json;
  switch (to_json(type, bytes, json, bytes_max)) {
  case converted::done: return json;
  case converted::wrong: return "wrong";
  case converted::too_big: return "too big";
  }
  return {};
}

std::string bytes_of(const message_type& type, std::string_view json, std::size_t bytes_max = 60000) {
  const auto value = json_value::parse(json);
  EXPECT_TRUE(value) << json;
  std::string bytes;
  std::string why;
  switch (from_json(type, *value, bytes, bytes_max, why)) {
  case converted::done: return bytes;
  case converted::wrong: return why;
  case converted::too_big: return "too big";
  }
  return {};
}

TEST(convert, keeps_every_value_both_ways) {
  const auto type = type_of(everything);
  const std::string json =
      R"({"b":true,"i8":-128,"u8":255,"i16":-32768,"u16":65535,"i32":-2147483648,"u32":4294967295,)"
      R"("i64":-9223372036854775808,"u64":18446744073709551615,"f32":0.1,"f64":1.7976931348623157e+308,)"
      R"("s":"\u00e9\"\u000a","t":{"secs":1,"nsecs":999999999},"d":{"secs":-1,"nsecs":5},"y":-1,"c":65,)"
      R"("bytes":"AP8=","three":"AQID","letters":"YWI=","small":[-1,2],"pair":[0.5,null],)"
      R"("points":[{"x":1,"e":{}},{"x":-0,"e":{}}],"names":["","a"]})";
  const std::string bytes = bytes_of(*type, json);
  std::string back = json_of(*type, bytes);
  // Text is written as it is, not in escapes that it does not need.
  const std::size_t at = json.find("\\u00e9");
  EXPECT_EQ(back, json.substr(0, at) + "\xc3\xa9" + json.substr(at + 6));
  EXPECT_EQ(bytes_of(*type, back), bytes);
}

TEST(convert, has_the_bytes_of_ros) {
  const auto type =
      type_of("Header header\nfloat32[] ranges\n"
              "================================================================================\n"
              "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n");
  const std::string bytes = "\1\0\0\0"
                            "\2\0\0\0"
                            "\3\0\0\0"
                            "\4\0\0\0"
                            "base"
                            "\2\0\0\0"
                            "\0\0\x80\x3f"
                            "\0\0\xc0\x7f"s;
  EXPECT_EQ(json_of(*type, bytes),
            R"({"header":{"seq":1,"stamp":{"secs":2,"nsecs":3},"frame_id":"base"},"ranges":[1,null]})");
  EXPECT_EQ(
      bytes_of(*type,
               R"({"ranges":[1,null],"header":{"frame_id":"base","stamp":{"sec":2,"nanosec":3},"seq":1}})"),
      bytes);
}

TEST(convert, leaves_out_members_as_rosbridge_does) {
  const auto type = type_of("int32 a\nstring s\nfloat64[2] p\nint8[] l\ntime t\nbool b\n");
  EXPECT_EQ(json_of(*type, bytes_of(*type, "{}")),
            R"({"a":0,"s":"","p":[0,0],"l":[],"t":{"secs":0,"nsecs":0},"b":false})");
}

TEST(convert, says_which_member_is_wrong) {
  const auto type = type_of(everything);
  EXPECT_EQ(bytes_of(*type, R"({"nam":1})"), R"(the message has a member "nam", which a/T has not)");
  EXPECT_EQ(bytes_of(*type, R"({"b":true,"b":true})"), R"(the message has the member "b" twice)");
  EXPECT_EQ(bytes_of(*type, R"([])"), "the message is no object, but a/T is one");
  EXPECT_EQ(bytes_of(*type, R"({"points":[{"x":1},{"x":1,"e":{"z":2}}]})"),
            R"(the member "points[1].e" has a member "z", which a/E has not)");
  EXPECT_EQ(bytes_of(*type, R"({"points":[{"x":1},7]})"),
            R"(the member "points[1]" is no object, but a/P is one)");
  EXPECT_EQ(bytes_of(*type, R"({"pair":[1]})"), R"(the member "pair" has 1 element; 2 are wanted)");
  EXPECT_EQ(bytes_of(*type, R"({"pair":[1,2,3]})"), R"(the member "pair" has more than 2 elements)");
  EXPECT_EQ(bytes_of(*type, R"({"three":"AQ=="})"), R"(the member "three" has 1 byte; 3 are wanted)");
  EXPECT_EQ(bytes_of(*type, R"({"bytes":"?"})"), R"(the member "bytes" is no base64)");
  EXPECT_EQ(bytes_of(*type, R"({"names":{}})"), R"(the member "names" is no array)");
  EXPECT_EQ(bytes_of(*type, R"({"t":{"hours":1}})"),
            R"(the member "t" has a member "hours"; a time has secs and nsecs)");
  for (const auto& [member, what] : std::map<std::string, std::string>{{"i8", "128"},
                                                                       {"u8", "-1"},
                                                                       {"u16", "65536"},
                                                                       {"u64", "1.5"},
                                                                       {"s", "1"},
                                                                       {"b", "1"},
                                                                       {"f64", "\"x\""}}) {
    const std::string why = bytes_of(*type, "{\"" + member + "\":" + what + "}");
    EXPECT_TRUE(why.starts_with("the member \"" + member + "\" (")) << why;
  }
}

TEST(convert, takes_bytes_as_numbers_too) {
  const auto type = type_of("uint8[] bytes\nuint8[2] two\n");
  EXPECT_EQ(json_of(*type, bytes_of(*type, R"({"bytes":[0,255],"two":[1,2]})")),
            R"({"bytes":"AP8=","two":"AQI="})");
}

TEST(convert, replaces_what_is_no_utf_8) {
  const auto type = type_of("string s\n");
  const std::string json = json_of(*type, "\2\0\0\0a\xff"s);
  EXPECT_EQ(json, "{\"s\":\"a\xef\xbf\xbd\"}");
}

TEST(convert, stops_at_a_bound) {
  const auto type = type_of(everything);
  const std::string bytes = bytes_of(*type, "{}");
  const std::string json = json_of(*type, bytes);
  EXPECT_EQ(json_of(*type, bytes, json.size()), json);
  EXPECT_EQ(json_of(*type, bytes, json.size() - 1), "too big");
  EXPECT_EQ(bytes_of(*type, "{}", bytes.size()), bytes);
  EXPECT_EQ(bytes_of(*type, "{}", bytes.size() - 1), "too big");
  // Elements without bytes cost nothing to claim.
  const auto empty =
      type_of("E[] e\n================================================================================\n"
              "MSG: a/E\n");
  EXPECT_EQ(json_of(*empty, "\xff\xff\xff\xff"), "too big");
  const auto large = type_of("float64[16777216] a\n");
  EXPECT_EQ(bytes_of(*large, "{}"), "too big");
}

TEST(convert, refuses_bytes_that_end_early_or_late) {
  const auto type = type_of(everything);
  const std::string bytes = bytes_of(*type, R"({"s":"abc","bytes":"AP8=","points":[{}],"names":["x"]})");
  for (std::size_t i = 0; i < bytes.size(); ++i) EXPECT_EQ(json_of(*type, bytes.substr(0, i)), "wrong") << i;
  EXPECT_EQ(json_of(*type, bytes + '\0'), "wrong");
}

TEST(convert, makes_json_of_whatever_bytes_it_takes) {
  const auto type = type_of(everything);
  const std::string good =
      bytes_of(*type, R"({"s":"abc","bytes":"AP8=","points":[{},{}],"names":["x","y"]})");
  std::mt19937 random{7};
  int taken = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    const std::string json = json_of(*type, bytes);
    if (json == "wrong" || json == "too big") continue;
    ++taken;
    const auto value = json_value::parse(json);
    ASSERT_TRUE(value) << json;
    std::string back;
    std::string why;
    ASSERT_EQ(from_json(*type, *value, back, 60000, why), converted::done) << why << json;
  }
  EXPECT_GT(taken, 1000);
}

} // namespace
} // namespace convert_test
} // namespace rowe::ros1
