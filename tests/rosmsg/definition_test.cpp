// SPDX-License-Identifier: Apache-2.0
// Which definitions are read, and what is said of those that are not.
#include "types.hpp"

namespace definition_test {
namespace {

using namespace rosmsg_tests;

// What all members are that a message without any in JSON has.
std::string zeros(std::string_view definition, ros_version version) {
  const ros_type type = type_of(definition, version);
  std::string message;
  EXPECT_TRUE(type.from_json(ros_encoding::cdr, "{}", message, plenty));
  return json_of(type, ros_encoding::cdr, message);
}
std::string zeros1(std::string_view definition) { return zeros(definition, ros_version::ros1); }
std::string zeros2(std::string_view definition) { return zeros(definition, ros_version::ros2); }

std::string wrong(std::string_view definition, ros_version version) {
  std::string why;
  const auto made = ros_type::parse("test/Root", definition, version, &why);
  EXPECT_FALSE(made) << definition;
  EXPECT_EQ(made.code(), rowe::errc::bad_definition);
  return why;
}
std::string wrong1(std::string_view definition) { return wrong(definition, ros_version::ros1); }
std::string wrong2(std::string_view definition) { return wrong(definition, ros_version::ros2); }

TEST(definition, has_all_built_in_types_of_ros_1) {
  EXPECT_EQ(zeros1("bool a\nint8 b\nuint8 c\nint16 d\nuint16 e\nint32 f\nuint32 g\nint64 h\nuint64 i\n"
                   "float32 j\nfloat64 k\nstring l\ntime m\nduration n\nbyte o\nchar p"),
            R"({"a":false,"b":0,"c":0,"d":0,"e":0,"f":0,"g":0,"h":0,"i":0,"j":0,"k":0,"l":"",)"
            R"("m":{"secs":0,"nsecs":0},"n":{"secs":0,"nsecs":0},"o":0,"p":0})");
}

TEST(definition, has_all_built_in_types_of_ros_2) {
  EXPECT_EQ(zeros2("bool a\nint8 b\nwstring c\nbuiltin_interfaces/Time d\n"
                   "builtin_interfaces/msg/Duration e\nbyte f\nchar g\nstring<=4 h\nwstring<=4 i"),
            R"({"a":false,"b":0,"c":"","d":{"sec":0,"nanosec":0},"e":{"sec":0,"nanosec":0},"f":0,"g":0,)"
            R"("h":"","i":""})");
}

TEST(definition, writes_bytes_as_base64_and_ros_1s_byte_is_signed) {
  EXPECT_EQ(zeros1("byte[3] a\nchar[3] b\nuint8[3] c\nuint8[] d\nint8[2] e"),
            R"({"a":[0,0,0],"b":"AAAA","c":"AAAA","d":"","e":[0,0]})");
  EXPECT_EQ(zeros2("byte[3] a\nchar[3] b\nuint8[<=3] c"), R"({"a":"AAAA","b":"AAAA","c":""})");
}

TEST(definition, may_have_comments_constants_and_any_white_space) {
  EXPECT_EQ(zeros1("# comment\n\n  uint8 A=1 # one\nuint8 B = 2\nstring C=\"x # no comment\nstring D=\n"
                   "\tint32\t x  # a = b\r\nfloat64[2] y# c\nfloat32 PI=3.14\nbool YES=True\n"),
            R"({"x":0,"y":[0,0]})");
  EXPECT_EQ(zeros2("string A=\"b # c\"\nint32 B=-1\nint8[] x # y\n"), R"({"x":[]})");
  EXPECT_EQ(zeros2(""), "{}");
  EXPECT_EQ(zeros2("uint8 ONLY=1"), "{}");
}

TEST(definition, has_defaults_in_ros_2) {
  EXPECT_EQ(zeros2("bool a true\nbool b False\nint8 c -128\nuint8 d 0xff # e\nuint64 e 18446744073709551615\n"
                   "float32 f .5\nfloat64 g -1e3\nfloat64 h +1.\nfloat64 i nan\nfloat64 j inf"),
            R"({"a":true,"b":false,"c":-128,"d":255,"e":18446744073709551615,"f":0.5,"g":-1000,"h":1,)"
            R"("i":null,"j":null})");
  EXPECT_EQ(zeros2("string a \"x # \\\"y\\\"\" # c\nstring c plain words # c\nstring<=3 d \"\\n\\u00e4\"\n"
                   "wstring e \"\\U0001f600\"\nstring f \"\"\nstring g '\\x41'"),
            "{\"a\":\"x # \\\"y\\\"\",\"c\":\"plain words\",\"d\":\"\\n\xc3\xa4\",\"e\":\"\xf0\x9f\x98\x80\","
            "\"f\":\"\",\"g\":\"A\"}");
  EXPECT_EQ(zeros2("int32[] a [1, 2, -3]\nfloat64[2] b [0.5,1]\nstring[] c ['x', \"y, z\", w]\nint8[] d []\n"
                   "uint8[3] e [1, 2, 3] # f"),
            R"({"a":[1,2,-3],"b":[0.5,1],"c":["x","y, z","w"],"d":[],"e":"AQID"})");
}

TEST(definition, writes_infinite_defaults_as_they_are) {
  const ros_type type = ros2("float32 a -inf\nfloat64 b inf");
  EXPECT_EQ(bytes_of(type, ros_encoding::cdr, "{}"), "00010000"
                                                     "000080ff"
                                                     "00000000"
                                                     "000000000000f07f");
}

TEST(definition, finds_types_in_parts_by_their_whole_and_their_relative_names) {
  const std::string point = part("other_msgs/Point", "float64 x");
  EXPECT_EQ(zeros1("other_msgs/Point a\n" + point), R"({"a":{"x":0}})");
  EXPECT_EQ(zeros2("other_msgs/msg/Point a\nother_msgs/Point b\n" + point), R"({"a":{"x":0},"b":{"x":0}})");
  EXPECT_EQ(zeros2("other_msgs/Point a\n" + part("other_msgs/msg/Point", "Inner i") +
                   part("other_msgs/msg/Inner", "bool b") + part("test/Inner", "int8 c")),
            R"({"a":{"i":{"b":false}}})");
  EXPECT_EQ(zeros1("Point a\n" + point), R"({"a":{"x":0}})") << "there is only one of the name";
}

TEST(definition, knows_the_header_of_ros_1_without_its_package) {
  EXPECT_EQ(zeros1("Header header\n" + part("std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id")),
            R"({"header":{"seq":0,"stamp":{"secs":0,"nsecs":0},"frame_id":""}})");
  EXPECT_EQ(zeros1("Header h\n" + part("test/Header", "bool own") + part("std_msgs/Header", "uint32 seq")),
            R"({"h":{"seq":0}})");
  EXPECT_EQ(zeros2("Header h\n" + part("test/Header", "bool own") + part("std_msgs/Header", "uint32 seq")),
            R"({"h":{"own":false}})");
}

TEST(definition, takes_a_type_that_is_there_twice_once) {
  EXPECT_EQ(zeros1("A a\n" + part("test/A", "bool x") + part("test/A", "bool x")), R"({"a":{"x":false}})");
  EXPECT_EQ(zeros1("bool x\n" + part("test/Root", "bool x")), R"({"x":false})");
}

TEST(definition, may_say_the_name_of_the_message_first) {
  EXPECT_EQ(zeros2("MSG: test/msg/Root\nbool x\n"), R"({"x":false})");
}

TEST(definition, may_define_ros_2s_times) {
  EXPECT_EQ(zeros2("builtin_interfaces/Time t\n" +
                   part("builtin_interfaces/Time", "# seconds\nint32 sec\nuint32 nanosec")),
            R"({"t":{"sec":0,"nanosec":0}})");
  EXPECT_EQ(zeros2("builtin_interfaces/Time t\n" + part("builtin_interfaces/Time", "int64 other")),
            R"({"t":{"other":0}})");
}

TEST(definition, takes_the_names_of_ros_1s_times_for_those_of_ros_2) {
  EXPECT_EQ(zeros2("time t\nduration[1] d"), R"({"t":{"sec":0,"nanosec":0},"d":[{"sec":0,"nanosec":0}]})");
}

TEST(definition, keeps_the_name_that_it_was_given) {
  const ros_type type = type_of("", ros_version::ros2, "std_msgs/msg/Empty");
  EXPECT_EQ(type.name(), "std_msgs/msg/Empty");
  EXPECT_EQ(type.version(), ros_version::ros2);
}

TEST(definition, says_which_line_is_wrong_and_why) {
  EXPECT_EQ(wrong1("float64 x\nfloat y"), "line 2: there is no definition of the type float");
  EXPECT_EQ(wrong1("int32"), "line 1: a type without a name behind it");
  EXPECT_EQ(wrong1("int32 # x"), "line 1: a type without a name behind it");
  EXPECT_EQ(wrong1("int32 9x"), R"(line 1: "9x" is no name of a member)");
  EXPECT_EQ(wrong1("int32 a-b"), R"(line 1: "a-b" is no name of a member)");
  EXPECT_EQ(wrong1("int32 x 5"), R"(line 1: "5" stands behind the name)");
  EXPECT_EQ(wrong1("in+t x"), R"(line 1: "in+t" is no type)");
  EXPECT_EQ(wrong1("a/b/c/d x"), R"(line 1: "a/b/c/d" is no type)");
  EXPECT_EQ(wrong1("int32[x] y"), R"(line 1: "x" is no length of an array)");
  EXPECT_EQ(wrong1("int32[<=4] y"), R"(line 1: "<=4" is no length of an array)");
  EXPECT_EQ(wrong1("int32[4294967296] y"), R"(line 1: "4294967296" is no length of an array)");
  EXPECT_EQ(wrong1("int32[0] y"), "line 1: the array has no elements");
  EXPECT_EQ(wrong1("int32] y"), "line 1: the type has a ] without a [");
  EXPECT_EQ(wrong1("int32[2][3] y"), R"(line 1: "2][3" is no length of an array)");
  EXPECT_EQ(wrong1("bool x\nbool x"), "line 2: a second member of the name x");
  EXPECT_EQ(wrong1("Other X=1"), "line 1: a constant must be a number, a bool or a string");
  EXPECT_EQ(wrong1("int8[2] X=1"), "line 1: a constant cannot be an array");
  EXPECT_EQ(wrong1("int8 X="), "line 1: a constant without a value");
  EXPECT_EQ(wrong1("wstring x"), "line 1: there is no definition of the type wstring");
  EXPECT_EQ(wrong2("int8<=3 x"), R"(line 1: only strings have a longest length: "int8<=3")");
  EXPECT_EQ(wrong2("string<=a x"), R"(line 1: "a" is no length of a string)");
}

TEST(definition, says_which_default_is_wrong) {
  EXPECT_EQ(wrong2("int8 x y"), R"(line 1: "y" is no default of this type)");
  EXPECT_EQ(wrong2("int8 x 1.5"), R"(line 1: "1.5" is no default of this type)");
  EXPECT_EQ(wrong2("int8 x 128"),
            "line 1: the default of x must be a whole number from -128 to 127; it is 128");
  EXPECT_EQ(wrong2("uint8 x -1"), "line 1: the default of x must be a whole number from 0 to 255; it is -1");
  EXPECT_EQ(wrong2("string<=2 x \"abc\""),
            "line 1: the default of x must be a string of at most 2 bytes; it has 3");
  EXPECT_EQ(wrong2("int8[2] x [1]"), "line 1: the default of x must be an array of 2 elements; it has 1");
  EXPECT_EQ(wrong2("int8[<=2] x [1, 2, 3]"),
            "line 1: the default of x must be an array of at most 2 elements; it has 3");
  EXPECT_EQ(wrong2("int8[] x [1"), R"(line 1: "[1" is no default of this type)");
  EXPECT_EQ(wrong2("int8[] x 1"), R"(line 1: "1" is no default of this type)");
  EXPECT_EQ(wrong2("string x \"a"), R"x(line 1: ""a" is no default of this type)x");
  EXPECT_EQ(wrong2("string x \"a\" b"), R"x(line 1: ""a" b" is no default of this type)x");
  EXPECT_EQ(wrong2("string x \"\\ud800\""), R"x(line 1: ""\ud800"" is no default of this type)x");
  EXPECT_EQ(wrong2("Other x 1"), R"(line 1: only numbers, bools and strings have a default: "1")");
}

TEST(definition, says_which_part_is_wrong) {
  const std::string line(80, '=');
  EXPECT_EQ(wrong1("bool x\n" + line + "\nbool y\n"), "line 3: `MSG: package/Type` must stand here");
  EXPECT_EQ(wrong1("bool x\n" + line), "line 2: a part without `MSG: package/Type`");
  EXPECT_EQ(wrong1("bool x\n" + line + "\n" + line), "line 3: a part without `MSG: package/Type`");
  EXPECT_EQ(wrong1("bool x\n" + line + "\nMSG: Name\n"),
            "line 3: `MSG:` without a name package/Type behind it");
  EXPECT_EQ(wrong1("bool x\nMSG: a/B\n"), "line 2: `MSG:` without a line of = before it");
  EXPECT_EQ(wrong1("bool x\n" + line + "\nMSG: a/B\n\nbool y\nbad\n"),
            "line 6: a type without a name behind it");
}

TEST(definition, says_which_type_is_missing_or_has_itself_inside) {
  EXPECT_EQ(wrong1("bool x\nother/Type y\n"), "line 2: there is no definition of the type other/Type");
  EXPECT_EQ(wrong1("Root x\n"), "line 1: the type Root has itself as a member");
  EXPECT_EQ(wrong1("A[] x\n" + part("test/A", "test/B b") + part("test/B", "test/A[] a")),
            "line 7: the type test/A has itself as a member");
  EXPECT_EQ(wrong1("Point a\n" + part("a/Point", "bool x") + part("b/Point", "bool x")),
            "line 1: there is no definition of the type Point");
}

} // namespace
} // namespace definition_test
