// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/json_check.hpp"

#include <gtest/gtest.h>

namespace rowe::tools {
namespace json_check_test {
namespace {

std::string nested(std::size_t depth) {
  std::string text;
  for (std::size_t i = 1; i < depth; ++i) text += R"({"a":)";
  text += "{}";
  return text + std::string(depth - 1, '}');
}

TEST(json_check, takes_what_rfc_8259_calls_an_object) {
  for (const char* text :
       {"{}", " \t\r\n{ } ", R"({"a":1})", R"({"a":-0.5e-10,"b":[1,2,{"c":null}],"d":true,"e":false})",
        R"({"":""})", R"({"a":"\"\\\/\b\f\n\r\t\u00e4\ud83d\ude00"})",
        "{\"a\":\"\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80\x7f\"}", R"({"a":[],"a":{}})",
        R"({"a":0,"b":-0,"c":10,"d":1E+2,"e":0.0})"}) {
    EXPECT_EQ(object_fault(text), std::nullopt) << text;
  }
}

TEST(json_check, refuses_everything_else_and_says_where) {
  struct offence {
    std::string_view text;
    std::size_t at;
  };
  for (const auto& [text, at] : std::initializer_list<offence>{{"", 0},
                                                               {"[]", 0},
                                                               {"1", 0},
                                                               {"{", 1},
                                                               {"{}x", 2},
                                                               {"{} {}", 3},
                                                               {R"({a:1})", 1},
                                                               {R"({'a':1})", 1},
                                                               {R"({"a"})", 4},
                                                               {R"({"a":})", 5},
                                                               {R"({"a":1,})", 7},
                                                               {R"({"a":1 "b":2})", 7},
                                                               {R"({"a":[1,]})", 8},
                                                               {R"({"a":[1})", 7},
                                                               {R"({"a":01})", 6},
                                                               {R"({"a":+1})", 5},
                                                               {R"({"a":.5})", 5},
                                                               {R"({"a":1.})", 7},
                                                               {R"({"a":1e})", 7},
                                                               {R"({"a":-})", 6},
                                                               {R"({"a":NaN})", 5},
                                                               {R"({"a":True})", 5},
                                                               {R"({"a":nul})", 5},
                                                               {R"({"a":"x)", 7},
                                                               {"{\"a\":\"\n\"}", 6},
                                                               {R"({"a":"\x"})", 7},
                                                               {R"({"a":"\u12g4"})", 10},
                                                               {R"({"a":"\ud800"})", 12},
                                                               {R"({"a":"\ude00"})", 12},
                                                               {R"({"a":"\ud800\u0041"})", 18},
                                                               {"{\"a\":\"\xff\"}", 6},
                                                               {"{\"a\":\"\xc0\x80\"}", 6},
                                                               {"{\"a\":\"\xed\xa0\x80\"}", 6},
                                                               {"{\"a\":\"\xf4\x90\x80\x80\"}", 6},
                                                               {"{\"a\":\"\xe2\x82\"}", 6}}) {
    const auto fault = object_fault(text);
    ASSERT_TRUE(fault) << text;
    EXPECT_EQ(fault->at, at) << text << ": " << fault->what;
    EXPECT_FALSE(fault->what.empty()) << text;
  }
}

TEST(json_check, bounds_the_nesting) {
  EXPECT_EQ(object_fault(nested(json_depth_max)), std::nullopt);
  const auto fault = object_fault(nested(json_depth_max + 1));
  ASSERT_TRUE(fault);
  EXPECT_EQ(sentence_of(*fault), "is no JSON object: it is nested more than 64 deep (at byte 320)");
  EXPECT_TRUE(object_fault(R"({"a":)" + std::string(100'000, '[')));
}

TEST(json_check, says_of_a_text_cut_short_that_it_ends_too_early) {
  const std::string_view whole = R"({"a":[1,true,"x\u00e4"]})";
  for (std::size_t bytes = 1; bytes < whole.size(); ++bytes) {
    const auto fault = object_fault(whole.substr(0, bytes));
    ASSERT_TRUE(fault) << bytes;
    const bool within_a_word = bytes >= 9 && bytes <= 11;
    EXPECT_EQ(fault->what, within_a_word ? "there is no such word" : "it ends too early") << bytes;
  }
}

} // namespace
} // namespace json_check_test
} // namespace rowe::tools
