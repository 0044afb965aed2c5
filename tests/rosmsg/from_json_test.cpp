// SPDX-License-Identifier: Apache-2.0
#include <rowe/json_value.hpp>

#include "types.hpp"

namespace from_json_test {
namespace {

using namespace rosmsg_tests;

std::string both(const ros_type& type, std::string_view json) {
  return bytes_of(type, ros_encoding::ros1, json);
}

TEST(from_json, writes_ros_1) {
  const ros_type type = ros1("bool a\nint8 b\nuint16 c\nint64 d\nfloat32 e\nstring f\ntime g\nduration h\n"
                             "uint8[] i\nint16[2] j\nstring[] k");
  EXPECT_EQ(
      both(type,
           R"({"a":true,"b":-128,"c":65535,"d":9223372036854775807,"e":0.1,"f":"a\"b",)"
           R"("g":{"secs":1,"nsecs":5},"h":{"secs":-1,"nsecs":-5},"i":"AQI=","j":[1,-2],"k":["","x"]})"),
      "0180ffffffffffffffffff7fcdcccc3d03000000612262"
      "0100000005000000fffffffffbffffff"
      "0200000001020100feff"
      "020000000000000001000000"
      "78");
}

TEST(from_json, writes_cdr_in_both_byte_orders_with_padding) {
  const ros_type type =
      ros2("uint8 a\nfloat64 b\nstring c\nint16 d\nint64[] e\nwstring f\nE g\n" + part("test/E", ""));
  constexpr std::string_view json =
      "{\"a\":1,\"b\":0.5,\"c\":\"x\",\"d\":-2,\"e\":[3],\"f\":\"\\ud83d\\ude00\xc3\xa4\"}";
  EXPECT_EQ(hex(bytes_of(type, ros_encoding::cdr, json)),
            hex("00010000 01 00000000000000 000000000000e03f 02000000 7800 feff 01000000 00000000 "
                "0300000000000000 03000000 3dd8 00de e400 00"));
  EXPECT_EQ(hex(bytes_of(type, ros_encoding::cdr_big_endian, json)),
            hex("00000000 01 00000000000000 3fe0000000000000 00000002 7800 fffe 00000001 00000000 "
                "0000000000000003 00000003 d83d de00 00e4 00"));
}

TEST(from_json, takes_members_in_any_order) {
  const ros_type type = ros1("uint8 a\nuint8 b\nuint8 c");
  for (const char* json :
       {R"({"a":1,"b":2,"c":3})", R"({"c":3,"b":2,"a":1})", R"({"a":1,"c":3,"b":2})",
        R"( { "b" : 2 , "\u0061" : 1 , "c" : 3 } )", R"({"x":[{}],"a":1,"b":2,"y":"}","c":3,"z":0})"})
    EXPECT_EQ(both(type, json), "010203") << json;
}

TEST(from_json, takes_many_members_in_any_order) {
  std::string definition, backwards;
  std::string wanted;
  for (int i = 0; i < 200; ++i) {
    definition += "uint8 m" + std::to_string(i) + "\n";
    backwards = "\"m" + std::to_string(i) + "\":" + std::to_string(i) + (i == 0 ? "" : ",") + backwards;
    wanted += std::string{"0123456789abcdef"[i / 16]} + "0123456789abcdef"[i % 16];
  }
  const ros_type type = ros1(definition);
  EXPECT_EQ(both(type, "{" + backwards + "}"), wanted);
  EXPECT_EQ(both(type, "{" + backwards + ",\"m7\":1}"), "duplicate_member: the member \"m7\" occurs twice");
  EXPECT_EQ(both(type, "{" + backwards + ",\"m150\":1}"),
            "duplicate_member: the member \"m150\" occurs twice");
}

TEST(from_json, fills_what_is_left_out) {
  const ros_type type =
      ros2("uint8 a 7\nstring b\nuint16[2] c\nP d\nP[2] e\nP[] f\nbuiltin_interfaces/Time g\n" +
           part("test/P", "int8 x -1\nbool y"));
  EXPECT_EQ(json_of(type, ros_encoding::cdr,
                    hex(bytes_of(type, ros_encoding::cdr, R"({"d":{"y":true},"f":[{}]})"))),
            R"({"a":7,"b":"","c":[0,0],"d":{"x":-1,"y":true},"e":[{"x":-1,"y":false},{"x":-1,"y":false}],)"
            R"("f":[{"x":-1,"y":false}],"g":{"sec":0,"nanosec":0}})");
}

TEST(from_json, passes_over_members_that_the_type_has_not) {
  EXPECT_EQ(both(ros1("uint8 a"), R"({"z":{"a":[1,{"a":5}]},"a":1,"b":null})"), "01");
  EXPECT_EQ(both(ros1(""), R"({"z":1})"), "");
  EXPECT_EQ(bytes_of(ros2(""), ros_encoding::cdr, R"({"z":1})"), "0001000000");
}

TEST(from_json, refuses_a_member_that_occurs_twice) {
  const ros_type type = ros1("P p\ntime t\n" + part("test/P", "bool x\nbool y"));
  EXPECT_EQ(both(type, R"({"p":{"x":true,"x":true}})"), "duplicate_member: the member \"p.x\" occurs twice");
  EXPECT_EQ(both(type, R"({"p":{"y":true,"\u0079":true}})"),
            "duplicate_member: the member \"p.y\" occurs twice");
  EXPECT_EQ(both(type, R"({"t":{"sec":1,"secs":1}})"),
            "duplicate_member: the member \"t.secs\" occurs twice");
  EXPECT_EQ(both(ros1(""), R"({"z":1,"z":2})"), "") << "what is passed over is not looked at";
}

TEST(from_json, reads_numbers_however_they_are_written) {
  EXPECT_EQ(both(ros1("uint8[] x"), R"({"x":[3,3.0,30e-1,0.3e1,-0]})"), "050000000303030300");
  EXPECT_EQ(both(ros1("float64 x"), R"({"x":null})"), "000000000000f87f");
  EXPECT_EQ(both(ros1("float32 x"), R"({"x":-0.0})"), "00000080");
  EXPECT_EQ(both(ros1("uint64 a\nint64 b"), R"({"a":18446744073709551615,"b":-9223372036854775808})"),
            "ffffffffffffffff0000000000000080");
}

TEST(from_json, checks_ranges) {
  const auto one = [](std::string_view type, std::string_view json) {
    return both(ros1(std::string{type} + " x"), R"({"x":)" + std::string{json} + "}");
  };
  EXPECT_EQ(one("int8", "128"),
            "out_of_range: the member \"x\" must be a whole number from -128 to 127; it is 128");
  EXPECT_EQ(one("int8", "-129"),
            "out_of_range: the member \"x\" must be a whole number from -128 to 127; it is -129");
  EXPECT_EQ(one("uint16", "-1"),
            "out_of_range: the member \"x\" must be a whole number from 0 to 65535; it is -1");
  EXPECT_EQ(one("int64", "9223372036854775808"),
            "out_of_range: the member \"x\" must be a whole number of 64 bits; it is 9223372036854775808");
  EXPECT_EQ(one("uint64", "18446744073709551616"),
            "out_of_range: the member \"x\" must be a whole number of 64 bits that is not negative; it is "
            "18446744073709551616");
  EXPECT_EQ(one("uint8", "1.5"),
            "wrong_type: the member \"x\" must be a whole number from 0 to 255; it is 1.5");
  EXPECT_EQ(one("uint8", "null"),
            "wrong_type: the member \"x\" must be a whole number from 0 to 255; it is null");
  EXPECT_EQ(one("float32", "1e39"),
            "out_of_range: the member \"x\" must be a number of single precision; it is 1e39");
  EXPECT_EQ(one("float64", "\"1\""), "wrong_type: the member \"x\" must be a number; it is \"1\"");
  EXPECT_EQ(one("bool", "1"), "wrong_type: the member \"x\" must be true or false; it is 1");
  EXPECT_EQ(one("string", "[1,\n2]"), "wrong_type: the member \"x\" must be a string; it is [1, 2]");
  EXPECT_EQ(one("time", "1"), "wrong_type: the member \"x\" must be an object; it is 1");
  EXPECT_EQ(one("time", R"({"secs":-1})"),
            "out_of_range: the member \"x.secs\" must be a whole number from 0 to 4294967295; it is -1");
  EXPECT_EQ(one("int8[2]", "[1]"), "too_long: the member \"x\" must be an array of 2 elements; it has 1");
  EXPECT_EQ(one("int8[2]", "[1,2,3]"), "too_long: the member \"x\" must be an array of 2 elements; it has 3");
  EXPECT_EQ(one("int8[]", "[1,true]"),
            "wrong_type: the member \"x[1]\" must be a whole number from -128 to 127; it is true");
  EXPECT_EQ(one("int8[]", "\"AA==\""), "wrong_type: the member \"x\" must be an array; it is \"AA==\"");
}

TEST(from_json, checks_bounds) {
  const ros_type type = ros2("string<=2 a\nstring<=1[<=2] b\nwstring<=1 c\nuint8[<=2] d");
  const auto json = [&](std::string_view text) { return bytes_of(type, ros_encoding::cdr, text); };
  EXPECT_TRUE(json(R"({"a":"\u00e4","b":["x","y"],"c":"\u00e4","d":"AQI="})").starts_with("0001"));
  EXPECT_EQ(json(R"({"a":"\u00e4x"})"),
            "too_long: the member \"a\" must be a string of at most 2 bytes; it has 3");
  EXPECT_EQ(json(R"({"b":["x","yz"]})"),
            "too_long: the member \"b[1]\" must be a string of at most 1 byte; it has 2");
  EXPECT_EQ(json(R"({"b":["","",""]})"),
            "too_long: the member \"b\" must be an array of at most 2 elements; it has 3");
  EXPECT_EQ(json(R"({"c":"\ud83d\ude00"})"),
            "too_long: the member \"c\" must be a string of at most 1 unit; it has 2");
  EXPECT_EQ(json(R"({"d":"AAAA"})"),
            "too_long: the member \"d\" must be base64, or an array of at most 2 elements; it has 3");
  EXPECT_EQ(json(R"({"d":"A"})"),
            "wrong_type: the member \"d\" must be base64, or an array of at most 2 elements; it is \"A\"");
  EXPECT_EQ(json(R"({"d":"A?=="})"),
            "wrong_type: the member \"d\" must be base64, or an array of at most 2 elements; it is \"A?==\"");
}

TEST(from_json, takes_bytes_as_base64_and_as_numbers) {
  const ros_type type = ros1("uint8[] x\nuint8[2] y");
  EXPECT_EQ(both(type, R"({"x":"AQI=","y":[3,4]})"), "0200000001020304");
  EXPECT_EQ(both(type, R"({"x":[1,2],"y":"AwQ\u003d"})"), "0200000001020304");
}

TEST(from_json, takes_times_with_the_names_of_either_version) {
  for (const char* json : {R"({"t":{"secs":1,"nsecs":2}})", R"({"t":{"sec":1,"nanosec":2}})",
                           R"({"t":{"nsec":2,"sec":1,"other":[3]}})"}) {
    EXPECT_EQ(both(ros1("time t"), json), "0100000002000000") << json;
    EXPECT_EQ(bytes_of(ros2("builtin_interfaces/Time t"), ros_encoding::cdr, json),
              "000100000100000002000000")
        << json;
  }
  EXPECT_EQ(both(ros1("time t"), R"({"t":{"nsecs":2}})"), "0000000002000000");
}

TEST(from_json, refuses_what_is_no_object_or_no_json) {
  const ros_type type = ros1("bool x");
  EXPECT_EQ(both(type, "[1]"), "not_an_object: the message must be an object; it is [1]");
  EXPECT_EQ(both(type, "{\"x\":tru}"), "malformed: the message is no valid JSON (at byte 8)");
  EXPECT_EQ(both(type, ""), "malformed: the message is no valid JSON (at byte 0)");
  EXPECT_EQ(both(type, "{\"x\":\"\xff\"}"), "malformed: the message is no valid JSON (at byte 6)");
  EXPECT_EQ(both(type, std::string(65, '[')), "too_deep: the message nests deeper than 64 levels");
}

TEST(from_json, takes_json_that_was_checked) {
  const ros_type type = ros1("uint8 x");
  const auto json = rowe::json_value::parse(R"( {"a":{"x":7},"b":[]} )").value();
  std::string message;
  ASSERT_TRUE(type.from_json(ros_encoding::ros1, *json.find("a"), message, plenty));
  EXPECT_EQ(message, "\7");
  std::string why;
  EXPECT_EQ(type.from_json(ros_encoding::ros1, *json.find("b"), message, plenty, &why).code(),
            rowe::errc::not_an_object);
  EXPECT_EQ(why, "the message must be an object; it is []");
  EXPECT_TRUE(type.from_json(ros_encoding::ros1, json, message, plenty));
  EXPECT_EQ(message, std::string(1, '\0')) << "it has no member x";
}

TEST(from_json, names_the_member_shortened) {
  const std::string long_name(200, 'a');
  EXPECT_EQ(both(ros1("bool " + long_name), "{\"" + long_name + "\":0}"),
            "wrong_type: the member \"" + long_name.substr(0, 160) + "...\" must be true or false; it is 0");
}

} // namespace
} // namespace from_json_test
