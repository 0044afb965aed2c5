// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "padded.hpp"
#include "json/reading/reader.hpp"

namespace rowe::json {
namespace member_index_test {
namespace {

using tests::padded;
using names = std::vector<std::string>;

// What the reader has indexed of a text that it accepted, and what a walk through the same text finds.
class member_index : public ::testing::Test {
 protected:
  // The names of the members that were indexed, when they are where the walk finds them.
  names indexed(std::string_view text) {
    const padded p{text};
    EXPECT_TRUE(reader_.validate(p.text())) << text;
    const document& last = reader_.last();
    EXPECT_EQ(last.text.data(), p.text().data());
    object_walk by_note{last}, by_text{p.text()};
    member a, b;
    while (by_text.next(a)) {
      EXPECT_TRUE(by_note.next(b)) << text;
      EXPECT_EQ(a.name_raw, b.name_raw);
      EXPECT_EQ(a.name_raw.data(), b.name_raw.data());
      EXPECT_EQ(a.what.type, b.what.type) << text;
      EXPECT_EQ(a.what.raw, b.what.raw);
      EXPECT_EQ(a.what.raw.data(), b.what.raw.data());
    }
    EXPECT_FALSE(by_note.next(b)) << text;
    names all;
    for (const member& m : last.indexed) all.emplace_back(m.name_raw);
    return all;
  }

  reader reader_ = reader::create(64 * 1024).value();
};

TEST_F(member_index, are_those_of_the_outermost_object_as_they_are_written) {
  EXPECT_EQ(indexed(R"({"op":"publish","msg":{"x":1,"y":[{"z":2}]},"latch":false})"),
            (names{"op", "msg", "latch"}));
  EXPECT_EQ(indexed(R"({"a":{"b":{}},"c":[],"d":[[],[]],"e":null})"), (names{"a", "c", "d", "e"}));
  EXPECT_EQ(indexed(R"({"a":1,"a":2})"), (names{"a", "a"}));
  EXPECT_EQ(indexed(" { \"a\" : 1 , \"b\"\t:\n[ 2 ] ,\"c\":\"d e \" }\r\n"), (names{"a", "b", "c"}));
  EXPECT_EQ(indexed(R"({"\u006fp":"a\"b","\"":"\\"})"), (names{R"(\u006fp)", R"(\")"}));
}

TEST_F(member_index, are_none_where_there_is_no_object) {
  for (const std::string_view text :
       {"{}", " { } ", "[]", R"([{"a":1}])", R"("a")", "1", "true", "[[1],{}]"}) {
    EXPECT_EQ(indexed(text), names{}) << text;
  }
}

TEST_F(member_index, are_the_first_of_many) {
  std::string text = "{";
  for (int i = 0; i < 100; ++i) text += "\"" + std::to_string(i) + "\": [" + std::to_string(i) + "] ,";
  text.back() = '}';
  const names first = indexed(text);
  EXPECT_GE(first.size(), 8U);
  EXPECT_LT(first.size(), 100U);
}

// Its own scan accepts this; the check of tokens leaves it alone.
TEST_F(member_index, are_none_where_the_scan_decided) { EXPECT_EQ(indexed(R"({"a":1e-400})"), names{}); }

TEST_F(member_index, of_a_text_that_is_refused_are_none) {
  indexed(R"({"a":1})");
  const padded p{R"({"a":1,"b":})"};
  EXPECT_FALSE(reader_.validate(p.text()));
  EXPECT_TRUE(reader_.last().indexed.empty());
  EXPECT_TRUE(reader_.last().text.empty());
}

} // namespace
} // namespace member_index_test
} // namespace rowe::json
