// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/json_outline.hpp"

#include <gtest/gtest.h>

#include "tools/rowe/text/json_values.hpp"

namespace rowe::tools {
namespace json_outline_test {
namespace {

std::string outline(std::string_view text) { return outline_of(read_json(text)); }

TEST(json_outline, indents_objects_and_keeps_lists_of_scalars_on_a_line) {
  EXPECT_EQ(
      outline(R"({"header":{"seq":7,"frame_id":"odom"},"covariance":[0.1,0,-1e-7],"ok":true,"none":null})"),
      "header:\n  seq: 7\n  frame_id: \"odom\"\ncovariance: [0.1, 0, -1e-7]\nok: true\nnone: null\n");
}

TEST(json_outline, gives_each_object_of_a_list_a_dash) {
  EXPECT_EQ(outline(R"({"poses":[{"x":1},{"x":2,"y":[]}]})"),
            "poses:\n  -\n    x: 1\n  -\n    x: 2\n    y: []\n");
}

TEST(json_outline, shows_what_is_empty) { EXPECT_EQ(outline(R"({"a":{},"b":[]})"), "a: {}\nb: []\n"); }

TEST(json_outline, takes_any_value_at_the_top) {
  EXPECT_EQ(outline("-0.0"), "-0.0\n");
  EXPECT_EQ(outline("\"text\""), "\"text\"\n");
  EXPECT_EQ(outline("[1,[2,3]]"), "- 1\n- [2, 3]\n");
  EXPECT_EQ(outline("{}"), "{}\n");
}

TEST(json_outline, ignores_white_space_between_tokens) {
  EXPECT_EQ(outline(" { \"a\" : [ 1 ,\n2 ] ,\r\n\t\"b\" : 3 } "), "a: [1, 2]\nb: 3\n");
}

TEST(json_outline, does_not_end_strings_at_escaped_quotes) {
  EXPECT_EQ(outline(R"({"a":"x\"y\\","b":1})"), "a: \"x\\\"y\\\\\"\nb: 1\n");
}

TEST(json_outline, quotes_keys_that_could_be_taken_for_something_else) {
  EXPECT_EQ(outline(R"({"a b":1,"":2,"/odom":3})"), "\"a b\": 1\n\"\": 2\n/odom: 3\n");
}

TEST(json_outline, lets_no_control_character_through_to_a_terminal) {
  EXPECT_EQ(outline("{\"a\":\"\xc2\x9b"
                    "2J\x7f\"}"),
            "a: \"\\u009b2J\\u007f\"\n");
}

} // namespace
} // namespace json_outline_test
} // namespace rowe::tools
