// SPDX-License-Identifier: Apache-2.0
// Definitions, bytes and JSON that ask for more than they justify.
#include "types.hpp"

namespace limits_test {
namespace {

using namespace rosmsg_tests;

std::string wrong(const std::string& definition) {
  std::string why;
  EXPECT_FALSE(ros_type::parse("test/Root", definition, ros_version::ros1, &why));
  return why;
}

// Types T1 to Tn, of which each has `members` members of the next one; the last has `last`.
std::string nested(int levels, int members, const std::string& last) {
  std::string text;
  for (int level = 1; level <= levels; ++level) {
    std::string of;
    for (int i = 0; i < members; ++i) of += "T" + std::to_string(level + 1) + " m" + std::to_string(i) + "\n";
    if (level == levels) of = last;
    text += level == 1 ? of : part("test/T" + std::to_string(level), of);
  }
  return text;
}

std::string number(std::uint32_t n) { return {reinterpret_cast<const char*>(&n), sizeof n}; }

TEST(limits, allow_32_types_within_types) {
  const ros_type type = ros1(nested(32, 1, "bool x"));
  std::string json = "true";
  for (int i = 1; i <= 32; ++i) json = (i == 1 ? R"({"x":)" : R"({"m0":)") + json + "}";
  EXPECT_EQ(json_of(type, ros_encoding::ros1, "\1"), json);
  EXPECT_EQ(bytes_of(type, ros_encoding::ros1, json), "01");
  EXPECT_EQ(wrong(nested(33, 1, "bool x")), "line 124: types within types, more than 32 levels");
}

TEST(limits, allow_arrays_of_arrays_in_json_as_deep_as_types_are) {
  std::string text = "T2[] m\n";
  for (int level = 2; level <= 32; ++level)
    text += part("test/T" + std::to_string(level),
                 level == 32 ? "bool[] m" : "T" + std::to_string(level + 1) + "[] m");
  const ros_type type = ros1(text);
  std::string json = "[true]";
  for (int i = 1; i < 32; ++i) json = R"([{"m":)" + json + "}]";
  json = R"({"m":)" + json + "}";
  std::string message;
  ASSERT_TRUE(type.from_json(ros_encoding::ros1, json, message, plenty));
  EXPECT_EQ(json_of(type, ros_encoding::ros1, message), json);
}

TEST(limits, refuse_definitions_that_multiply) {
  EXPECT_EQ(wrong(nested(21, 2, "bool x")),
            "a value of the type test/Root has more than 1048576 objects at least");
  (void)ros1(nested(20, 2, "bool x"));
}

TEST(limits, refuse_long_texts_names_and_many_members) {
  EXPECT_EQ(wrong(std::string(1048577, '\n')), "the definition has 1048577 bytes; 1048576 are the most");
  EXPECT_EQ(wrong("bool " + std::string(256, 'x')),
            "line 1: \"" + std::string(60, 'x') + "...\" is no name of a member");
  std::string many;
  for (int i = 0; i < 1024; ++i) many += "bool m" + std::to_string(i) + "\n";
  EXPECT_EQ(wrong(many + "bool x"), "line 1025: more than 1024 members of a type");
  std::string types;
  for (int i = 0; i < 1024; ++i) types += part("test/T" + std::to_string(i), "");
  EXPECT_EQ(wrong(types), "line 3071: more than 1024 types");
  std::string all;
  for (int i = 0; i < 17; ++i) all += part("test/T" + std::to_string(i), many);
  EXPECT_EQ(wrong(all), "line 16435: more than 16384 members in all types");
}

TEST(limits, refuse_arrays_of_fixed_length_that_are_too_long) {
  EXPECT_EQ(wrong("uint8[268435457] x"),
            "a value of the type test/Root has more than 268435456 bytes at least");
  EXPECT_EQ(wrong("A[2048] x\n" + part("test/A", "B[1024] x") + part("test/B", "")),
            "a value of the type test/Root has more than 1048576 objects at least");
}

TEST(limits, refuse_arrays_for_which_there_are_not_bytes_enough) {
  for (const char* of : {"uint8", "string", "float64", "time", "T2"}) {
    const ros_type type =
        ros1(std::string{of} + "[] x\n" + part("test/T2", "bool a\nT3 b") + part("test/T3", ""));
    EXPECT_EQ(json_of(type, ros_encoding::ros1, number(0xffffffff) + "abc"),
              "bad_message: the member \"x\" is cut off (at byte 4 of 7)");
    EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000") + number(0xffffffff) + "abc"),
              "bad_message: the member \"x\" is cut off (at byte 8 of 11)");
  }
}

TEST(limits, count_messages_without_bytes) {
  const ros_type type = ros1("T2[] x\n" + part("test/T2", "T3[64] y") + part("test/T3", ""));
  const std::string one = R"({"y":[)" + [] {
    std::string all = "{}";
    for (int i = 1; i < 64; ++i) all += ",{}";
    return all;
  }() + "]}";
  EXPECT_EQ(json_of(type, ros_encoding::ros1, number(2)), R"({"x":[)" + one + "," + one + "]}");
  // 63 of 65 objects each, and the 64th is not whole.
  EXPECT_EQ(
      json_of(type, ros_encoding::ros1, number(1'000'000'000)),
      "bad_message: the member \"x[63].y[4]\" has more empty messages than it has bytes (at byte 4 of 4)");
  EXPECT_EQ(json_of(type, ros_encoding::cdr, hex("00010000") + number(1'000'000'000)),
            "bad_message: the member \"x\" is cut off (at byte 8 of 8)");
}

TEST(limits, hold_for_the_length_of_the_json) {
  const ros_type type = ros1("string a\nuint8[] b\nfloat64[] c\nT2[] d\n" + part("test/T2", "bool x"));
  const std::string json =
      R"({"a":"\u0001\u0001\u0001","b":"AAAA","c":[0.1,null],"d":[{"x":true},{"x":false}]})";
  std::string message;
  ASSERT_TRUE(type.from_json(ros_encoding::ros1, json, message, plenty));
  EXPECT_EQ(json_of(type, ros_encoding::ros1, message, json.size()), json);
  for (std::size_t limit = 0; limit < json.size(); ++limit) {
    const std::string found = json_of(type, ros_encoding::ros1, message, limit);
    ASSERT_TRUE(found.starts_with("too_big: the ")) << found;
    ASSERT_TRUE(found.ends_with(" is longer than " + std::to_string(limit) + " bytes in JSON") ||
                found == "too_big: the message is longer than " + std::to_string(limit) + " bytes")
        << found;
  }
}

TEST(limits, hold_for_the_length_of_the_message) {
  const ros_type type = ros2("string a\nuint8[] b\nfloat64[] c\nwstring d\nT2[] e\n" + part("test/T2", ""));
  const std::string json = R"({"a":"xyz","b":"AAAA","c":[0.1,null],"d":"x","e":[{},{}]})";
  std::string message;
  ASSERT_TRUE(type.from_json(ros_encoding::cdr, json, message, plenty));
  EXPECT_TRUE(type.from_json(ros_encoding::cdr, json, message, message.size()));
  const std::size_t bytes = message.size();
  for (std::size_t limit = 0; limit < bytes; ++limit) {
    const std::string found = bytes_of(type, ros_encoding::cdr, json, limit);
    ASSERT_TRUE(found.starts_with("too_big: the ")) << found;
  }
}

TEST(limits, do_not_let_short_json_make_long_messages) {
  const ros_type type = ros1("T2[] x\n" + part("test/T2", "float64[1000000] y"));
  EXPECT_EQ(bytes_of(type, ros_encoding::ros1, R"({"x":[{},{},{}]})", 9'000'000),
            "too_big: the member \"x[1].y\" is longer than 9000000 bytes");
  const ros_type empty =
      ros1("T2[] x\n" + part("test/T2", "T3[1000] y") + part("test/T3", "T4[1000] z") + part("test/T4", ""));
  std::string many = R"({"x":[{})";
  for (int i = 1; i < 100'000; ++i) many += ",{}";
  EXPECT_EQ(bytes_of(empty, ros_encoding::ros1, many + "]}"), "a0860100");
}

TEST(limits, keep_no_more_memory_than_was_written) {
  const ros_type type = ros1("string x");
  std::string json;
  const std::string lie = number(100'000'000) + "abc";
  ASSERT_FALSE(type.to_json(ros_encoding::ros1, lie, json, SIZE_MAX));
  EXPECT_LT(json.capacity(), 10'000U);
}

} // namespace
} // namespace limits_test
