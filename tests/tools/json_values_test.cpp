// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/json_values.hpp"

#include <gtest/gtest.h>

namespace rowe::tools {
namespace json_values_test {
namespace {

constexpr std::string_view pose =
    "{ \"pose\" : {\"x\":1.50, \"name\":\"a }\\\" b\"}, \"ranges\":[ 1 , [2,3], {\"q\":[]} ], \"x\":null }";

TEST(json_values, are_read_from_texts_of_people) {
  EXPECT_EQ(read_json(pose).find("pose.x")->text(), "1.50");
  EXPECT_EQ(read_json(" 7 ").text(), "7");
  for (const char* const text : {"", "{", "nul", "{}{}"}) EXPECT_EQ(read_json(text).kind(), json_kind::null);
}

TEST(json_values, say_of_a_text_that_is_no_object_where_it_is_wrong) {
  for (const char* const text : {"{}", " \t\r\n{ } ", R"({"a":[1,{"c":null}],"a":"\ud83d\ude00"})"}) {
    EXPECT_EQ(object_fault(text), "") << text;
  }
  const std::string before = "is no JSON object: ";
  EXPECT_EQ(object_fault("[]"), before + "it does not begin with {");
  EXPECT_EQ(object_fault(""), before + "it ends too early (at byte 0)");
  EXPECT_EQ(object_fault(R"({"a":[1)"), before + "it ends too early (at byte 7)");
  EXPECT_EQ(object_fault(R"({'a':1})"), before + "it is wrong at byte 1, from ''a':1}' on");
  EXPECT_EQ(object_fault("{\"a\":\"\x1b[2J\"}"), before + "it is wrong at byte 6, from '\\u001b[2J\"}' on");
  EXPECT_EQ(object_fault(R"({"a":1e999})"),
            before + "it is wrong at byte 5, or too large for a double, from '1e999}' on");
  EXPECT_EQ(object_fault("{}" + std::string(100, 'x')),
            before + "it is wrong at byte 2, from '" + std::string(24, 'x') + "' on");
  EXPECT_EQ(object_fault(R"({"a":)" + std::string(1000, '[')),
            before + "it is nested more than 64 deep (at byte 68)");
}

TEST(json_values, list_their_leaves_in_order) {
  std::string text;
  for (const json_leaf& leaf : leaves_of(read_json(pose)))
    text.append(leaf.path).append("=").append(leaf.value.text()).append(";");
  EXPECT_EQ(
      text,
      "pose.x=1.50;pose.name=\"a }\\\" b\";ranges[0]=1;ranges[1][0]=2;ranges[1][1]=3;ranges[2].q=[];x=null;");
  ASSERT_EQ(leaves_of(read_json("7")).size(), 1U);
  EXPECT_EQ(leaves_of(read_json("7"))[0].path, "");
}

TEST(json_values, lose_their_quotes_and_escapes_but_for_control_characters) {
  EXPECT_EQ(plain_text_of(read_json(R"("a\"b\\c\/d\u00e4\ud83d\ude00")")),
            "a\"b\\c/d\xc3\xa4\xf0\x9f\x98\x80");
  EXPECT_EQ(plain_text_of(read_json(R"("\n\u001b[2J\u007f\u009b")")), R"(\u000a\u001b[2J\u007f\u009b)");
  EXPECT_EQ(plain_text_of(read_json("1.50")), "1.50");
  EXPECT_EQ(plain_text_of(read_json("\"\"")), "");
}

TEST(json_values, take_and_lose_members) {
  EXPECT_EQ(with_member("{}", "a\"b", "1"), R"({"a\"b":1})");
  EXPECT_EQ(with_member(" { \"b\":2}", "a", "{}"), " {\"a\":{}, \"b\":2}");
  EXPECT_EQ(without_member(read_json(R"({"a":1,"b":{"a":2},"a":3})"), "a"), R"({"b":{"a":2}})");
  EXPECT_EQ(without_member(read_json(R"({"a":1})"), "a"), "{}");
  EXPECT_EQ(without_member(read_json(R"({"a":1, "b":2})"), "c"), R"({"a":1,"b":2})");
}

} // namespace
} // namespace json_values_test
} // namespace rowe::tools
