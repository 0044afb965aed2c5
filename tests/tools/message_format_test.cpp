// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/message_format.hpp"

#include <gtest/gtest.h>

#include "tools/rowe/text/json_values.hpp"
#include "tools/rowe/text/message_source.hpp"

namespace rowe::tools {
namespace message_format_test {
namespace {

using kind = message_format::kind;
using namespace std::chrono_literals;

TEST(message_format, writes_for_people) {
  message_format all{kind::pretty, "", false};
  EXPECT_EQ(all.text_of("/t", read_json(R"({"a":1,"b":{"c":[1,2]}})")), "a: 1\nb:\n  c: [1, 2]\n---\n");
  message_format part{kind::pretty, "b.c", false};
  EXPECT_EQ(part.text_of("/t", read_json(R"({"b":{"c":[1,2]}})")), "[1, 2]\n---\n");
}

TEST(message_format, writes_json_as_it_came_on_one_line) {
  message_format all{kind::json, "", false};
  EXPECT_EQ(all.text_of("/t", read_json("{\"a\":\r\n1.50}")), "{\"a\":  1.50}\n");
  message_format part{kind::json, "a", false};
  EXPECT_EQ(part.text_of("/t", read_json(R"({"a":"x\ny"})")), "\"x\\ny\"\n");
}

TEST(message_format, names_the_topic_where_there_are_several) {
  message_format json{kind::json, "a", true};
  EXPECT_EQ(json.text_of("/t\"\x1b", read_json(R"({"a":1})")), "{\"topic\":\"/t\\\"\\u001b\",\"msg\":1}\n");
  message_format pretty{kind::pretty, "", true};
  EXPECT_EQ(pretty.text_of("/t", read_json(R"({"a":1})")), "/t:\n  a: 1\n---\n");
}

TEST(message_format, has_nothing_to_write_where_the_field_is_missing) {
  for (const kind how : {kind::pretty, kind::json, kind::csv}) {
    message_format part{how, "a.b", false};
    EXPECT_EQ(part.text_of("/t", read_json(R"({"a":{"c":1}})")), std::nullopt);
  }
}

TEST(message_format, makes_a_table_with_a_header) {
  message_format table{kind::csv, "", false};
  EXPECT_EQ(table.text_of("/t", read_json(R"({"a":1,"b":{"c":[true,null]},"d":"x, \"y\"","e":{}})")),
            "a,b.c[0],b.c[1],d,e\n1,true,null,\"x, \"\"y\"\"\",{}\n");
  EXPECT_EQ(table.text_of("/t", read_json(R"({"a":2,"b":{"c":[false,0]},"d":"\n","e":{}})")),
            "2,false,0,\\u000a,{}\n");
  EXPECT_EQ(table.odd_rows(), 0U);
}

TEST(message_format, keeps_its_columns_when_messages_change) {
  message_format table{kind::csv, "", false};
  EXPECT_EQ(table.text_of("/t", read_json(R"({"a":1,"b":2})")), "a,b\n1,2\n");
  EXPECT_EQ(table.text_of("/t", read_json(R"({"b":4,"a":3})")), "3,4\n");
  EXPECT_EQ(table.odd_rows(), 0U);
  EXPECT_EQ(table.text_of("/t", read_json(R"({"b":5,"c":6})")), ",5\n");
  EXPECT_EQ(table.text_of("/t", read_json(R"({"a":7,"b":8,"c":9})")), "7,8\n");
  EXPECT_EQ(table.odd_rows(), 2U);
}

TEST(message_format, names_the_columns_of_a_field_by_their_whole_path) {
  message_format pose{kind::csv, "pose", false};
  EXPECT_EQ(pose.text_of("/t", read_json(R"({"pose":{"x":1,"y":2}})")), "pose.x,pose.y\n1,2\n");
  message_format ranges{kind::csv, "ranges", false};
  EXPECT_EQ(ranges.text_of("/t", read_json(R"({"ranges":[4,5]})")), "ranges[0],ranges[1]\n4,5\n");
  message_format one{kind::csv, "pose.x", false};
  EXPECT_EQ(one.text_of("/t", read_json(R"({"pose":{"x":1}})")), "pose.x\n1\n");
}

TEST(message_source, stamps_the_header) {
  constexpr rt::duration time = 1'700'000'001s + 5ns;
  constexpr std::string_view stamp = R"("stamp":{"secs":1700000001,"nsecs":5})";
  const std::string whole{stamp};
  EXPECT_EQ(stamped("{}", time), R"({"header":{)" + whole + "}}");
  EXPECT_EQ(stamped(R"({"a":1})", time), R"({"header":{)" + whole + R"(},"a":1})");
  EXPECT_EQ(stamped(R"({"header":{}})", time), R"({"header":{)" + whole + "}}");
  EXPECT_EQ(stamped(R"({"a":1,"header":{"seq":7,"stamp":{"secs":0,"nsecs":0},"frame_id":"f"}})", time),
            R"({"a":1,"header":{"seq":7,)" + whole + R"(,"frame_id":"f"}})");
  EXPECT_EQ(stamped(R"({"header":7})", time), std::nullopt);
}

} // namespace
} // namespace message_format_test
} // namespace rowe::tools
