// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/json_values.hpp"

#include <gtest/gtest.h>

namespace rowe::tools {
namespace json_values_test {
namespace {

constexpr std::string_view pose =
    "{ \"pose\" : {\"x\":1.50, \"name\":\"a }\\\" b\"}, \"ranges\":[ 1 , [2,3], {\"q\":[]} ], \"x\":null }";

TEST(json_values, find_what_stands_at_a_path) {
  EXPECT_EQ(value_at(pose, "pose.x"), "1.50");
  EXPECT_EQ(value_at(pose, "pose"), "{\"x\":1.50, \"name\":\"a }\\\" b\"}");
  EXPECT_EQ(value_at(pose, "ranges[0]"), "1");
  EXPECT_EQ(value_at(pose, "ranges[1][1]"), "3");
  EXPECT_EQ(value_at(pose, "ranges[2].q"), "[]");
  EXPECT_EQ(value_at(pose, "x"), "null");
  EXPECT_EQ(value_at(" 7 ", ""), "7");
}

TEST(json_values, find_nothing_where_nothing_is) {
  for (const char* path : {"y", "pose.y", "pose.x.y", "pose[0]", "ranges.x", "ranges[3]", "ranges[-1]",
                           "ranges[x]", "ranges[", "ranges[]", "ranges[0", "[0]", ".pose", "pose..x"}) {
    EXPECT_EQ(value_at(pose, path), std::nullopt) << path;
  }
}

TEST(json_values, list_their_leaves_in_order) {
  std::string text;
  for (const json_leaf& leaf : leaves_of(pose))
    text.append(leaf.path).append("=").append(leaf.value).append(";");
  EXPECT_EQ(
      text,
      "pose.x=1.50;pose.name=\"a }\\\" b\";ranges[0]=1;ranges[1][0]=2;ranges[1][1]=3;ranges[2].q=[];x=null;");
  ASSERT_EQ(leaves_of("7").size(), 1U);
  EXPECT_EQ(leaves_of("7")[0].path, "");
}

TEST(json_values, lose_their_quotes_and_escapes_but_for_control_characters) {
  EXPECT_EQ(plain_text_of(R"("a\"b\\c\/d\u00e4\ud83d\ude00")"), "a\"b\\c/d\xc3\xa4\xf0\x9f\x98\x80");
  EXPECT_EQ(plain_text_of(R"("\n\u001b[2J\u007f\u009b")"), R"(\n\u001b[2J\u007f\u009b)");
  EXPECT_EQ(plain_text_of("1.50"), "1.50");
  EXPECT_EQ(plain_text_of("\"\""), "");
}

TEST(json_values, take_and_lose_members) {
  EXPECT_EQ(with_member("{}", "a\"b", "1"), R"({"a\"b":1})");
  EXPECT_EQ(with_member(" { \"b\":2}", "a", "{}"), " {\"a\":{}, \"b\":2}");
  EXPECT_EQ(without_member(R"({"a":1,"b":{"a":2},"a":3})", "a"), R"({"b":{"a":2}})");
  EXPECT_EQ(without_member(R"({"a":1})", "a"), "{}");
  EXPECT_EQ(without_member(R"({"a":1, "b":2})", "c"), R"({"a":1,"b":2})");
}

} // namespace
} // namespace json_values_test
} // namespace rowe::tools
