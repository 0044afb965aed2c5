// SPDX-License-Identifier: Apache-2.0
#include "types.hpp"

namespace to_json_test {
namespace {

using namespace rosmsg_tests;

constexpr std::string_view twist = "Vector3 linear\nVector3 angular\n";
std::string twist_text() {
  return std::string{twist} + part("test/Vector3", "float64 x\nfloat64 y\nfloat64 z");
}

TEST(to_json, reads_ros_1) {
  const ros_type type = ros1("bool a\nint8 b\nuint16 c\nint64 d\nfloat32 e\nstring f\ntime g\nduration h\n"
                             "uint8[] i\nint16[2] j\nstring[] k");
  EXPECT_EQ(json_of(type, ros_encoding::ros1,
                    hex("02 80 ffff ffffffffffffff7f cdcccc3d 03000000 61 22 62 01000000 05000000 "
                        "ffffffff fbffffff 02000000 0102 0100 feff 02000000 00000000 01000000 78")),
            R"({"a":true,"b":-128,"c":65535,"d":9223372036854775807,"e":0.1,"f":"a\"b",)"
            R"("g":{"secs":1,"nsecs":5},"h":{"secs":-1,"nsecs":-5},"i":"AQI=","j":[1,-2],"k":["","x"]})");
}

TEST(to_json, reads_cdr_in_both_byte_orders_with_padding) {
  const ros_type type =
      ros2("uint8 a\nfloat64 b\nstring c\nint16 d\nint64[] e\nuint8 f\nbuiltin_interfaces/Time g\n"
           "uint16[] h");
  const std::string json =
      R"({"a":1,"b":0.5,"c":"xy","d":-2,"e":[3],"f":4,"g":{"sec":-1,"nanosec":5},"h":[6,7]})";
  EXPECT_EQ(json_of(type, ros_encoding::cdr,
                    hex("00010000 01 00000000000000 000000000000e03f 03000000 787900 00 feff 0000 01000000 "
                        "0300000000000000 04 000000 ffffffff 05000000 02000000 0600 0700")),
            json);
  EXPECT_EQ(json_of(type, ros_encoding::cdr_big_endian,
                    hex("00000000 01 00000000000000 3fe0000000000000 00000003 787900 00 fffe 0000 00000001 "
                        "0000000000000003 04 000000 ffffffff 00000005 00000002 0006 0007")),
            json);
}

TEST(to_json, does_not_pad_before_an_array_without_elements) {
  const ros_type type = ros2("float64[] a\nuint32 b");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 00000000 05000000")), R"({"a":[],"b":5})");
}

TEST(to_json, reads_the_byte_that_an_empty_message_has_in_cdr) {
  const ros_type type = ros2("E a\nE[] b\nuint8 c\n" + part("test/E", ""));
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 00 000000 02000000 00 00 07")),
            R"({"a":{},"b":[{},{}],"c":7})");
  EXPECT_EQ(json_of(type, ros_encoding::ros1, hex("02000000 07")), R"({"a":{},"b":[{},{}],"c":7})");
  EXPECT_EQ(json_of(ros2(""), ros_encoding::cdr, hex("00010000 00")), "{}");
  EXPECT_EQ(json_of(ros1(""), ros_encoding::ros1, ""), "{}");
}

TEST(to_json, writes_floats_as_short_as_they_are_and_null_for_what_json_has_not) {
  const ros_type type = ros1("float64[] x");
  EXPECT_EQ(json_of(type, ros_encoding::ros1,
                    hex("05000000 9a9999999999b93f 0000000000000080 000000000000f87f 000000000000f07f "
                        "ffffffffffffef7f")),
            R"({"x":[0.1,-0.0,null,null,1.7976931348623157e308]})");
}

TEST(to_json, replaces_what_is_no_utf_8_and_escapes_what_json_escapes) {
  const ros_type type = ros1("string x");
  EXPECT_EQ(json_of(type, ros_encoding::ros1, hex("07000000 61ffc3a40a0080")),
            "{\"x\":\"a\xef\xbf\xbd\xc3\xa4\\n\\u0000\xef\xbf\xbd\"}");
}

TEST(to_json, reads_strings_in_cdr_with_and_without_their_terminator) {
  const ros_type type = ros2("string x\nuint8 y");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 02000000 6100 07")), R"({"x":"a","y":7})");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 01000000 61 07")), R"({"x":"a","y":7})");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 00000000 07")), R"({"x":"","y":7})");
}

TEST(to_json, reads_wide_strings_as_utf_16) {
  const ros_type type = ros2("wstring x\nuint8 y");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 06000000 6100 e400 3dd8 00de 00d8 2200 07")),
            "{\"x\":\"a\xc3\xa4\xf0\x9f\x98\x80\xef\xbf\xbd\\\"\",\"y\":7}");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00000000 00000002 0061 dc00 07")),
            "{\"x\":\"a\xef\xbf\xbd\",\"y\":7}");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 06000000 6100")),
            "bad_message: the member \"x\" is cut off (at byte 8 of 10)");
}

TEST(to_json, writes_integers_with_every_digit) {
  const ros_type type = ros1("uint64 a\nint64 b");
  EXPECT_EQ(json_of(type, ros_encoding::ros1, hex("ffffffffffffffff 0000000000000080")),
            R"({"a":18446744073709551615,"b":-9223372036854775808})");
}

TEST(to_json, names_the_member_in_which_bytes_end) {
  const ros_type type = ros1(twist_text());
  EXPECT_EQ(json_of(type, ros_encoding::ros1, std::string(40, '\0')),
            "bad_message: the member \"angular.z\" is cut off (at byte 40 of 40)");
  EXPECT_EQ(json_of(type, ros_encoding::ros1, ""),
            "bad_message: the member \"linear.x\" is cut off (at byte 0 of 0)");
  const ros_type list = ros1("P[] p\n" + part("test/P", "string[] names"));
  EXPECT_EQ(json_of(list, ros_encoding::ros1, hex("02000000 00000000 01000000 05000000 61")),
            "bad_message: the member \"p[1].names[0]\" is cut off (at byte 16 of 17)");
}

TEST(to_json, refuses_what_is_longer_than_its_type) {
  const ros_type type = ros1(twist_text());
  EXPECT_EQ(json_of(type, ros_encoding::ros1, std::string(49, '\0')),
            "bad_message: the message is shorter than its bytes: 1 are left (at byte 48 of 49)");
  const ros_type byte = ros2("uint8 x");
  EXPECT_EQ(json_of(byte, ros_encoding::cdr, hex("00010000 01 00000000000000")), R"({"x":1})");
  EXPECT_EQ(json_of(byte, ros_encoding::cdr, hex("00010000 01 0000000000000000")),
            "bad_message: the message is shorter than its bytes: 8 are left (at byte 5 of 13)");
}

TEST(to_json, refuses_arrays_and_strings_longer_than_their_bounds) {
  const ros_type type = ros2("int8[<=2] x");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 02000000 0102")), R"({"x":[1,2]})");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000 03000000 010203")),
            "bad_message: the member \"x\" has 3 elements; 2 are the most (at byte 8 of 11)");
  const ros_type texts = ros2("string<=2 x\nwstring<=2 y");
  EXPECT_EQ(json_of(texts, ros_encoding::cdr, hex("00010000 04000000 61616100")),
            "bad_message: the member \"x\" has 3 bytes; 2 are the most (at byte 12 of 12)");
  EXPECT_EQ(json_of(texts, ros_encoding::cdr, hex("00010000 00000000 03000000 610061006100")),
            "bad_message: the member \"y\" has 3 units; 2 are the most (at byte 12 of 18)");
}

TEST(to_json, names_other_encodings_of_dds) {
  const ros_type type = ros2("uint8 x");
  const auto with = [&](std::string_view head) {
    return json_of(type, ros_encoding::cdr, hex(head) + std::string(8, '\0'));
  };
  EXPECT_EQ(with("00030000"),
            "bad_message: the message is in PL_CDR (a parameter list), and only plain CDR is read");
  EXPECT_EQ(with("00070000"),
            "bad_message: the message is in CDR2 (plain XCDR2), and only plain CDR is read");
  EXPECT_EQ(with("00090000"),
            "bad_message: the message is in D_CDR2 (delimited XCDR2), and only plain CDR is read");
  EXPECT_EQ(with("000a0000"),
            "bad_message: the message is in PL_CDR2 (a parameter list of XCDR2), and only plain CDR is read");
  EXPECT_EQ(with("01010000"), "bad_message: the message is in the unknown encapsulation 257");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, "abc"),
            "bad_message: the message has no head of CDR: it has 3 bytes");
}

TEST(to_json, needs_no_place_for_the_reason) {
  std::string json = "before";
  EXPECT_EQ(ros1("bool x").to_json(ros_encoding::ros1, "", json, plenty).code(), rowe::errc::bad_message);
  EXPECT_EQ(json, "");
}

} // namespace
} // namespace to_json_test
