// SPDX-License-Identifier: Apache-2.0
#include "wire/text/word_table.hpp"

#include <gtest/gtest.h>

#include <string>

#include "wire/codec/members.hpp"

namespace word_table_test {
namespace {

using rowe::wire::find_escaped;
using rowe::wire::word_table;

constexpr word_table words{"op", "id", "topic", "level", "latch", "subscribe", "advertise"};

TEST(word_table, finds_each_of_its_words) {
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_EQ(words.find(words[i]), i) << words[i];
}

TEST(word_table, finds_nothing_else) {
  for (const std::string_view other : {"", "o", "p", "oq", "ops", "Topic", "topid", "topics", "aatch"})
    EXPECT_EQ(words.find(other), words.size()) << other;
  for (int byte = 0; byte < 256; ++byte) {
    const std::string other{static_cast<char>(byte), 'p'};
    EXPECT_EQ(words.find(other) == 0, other == "op");
  }
}

TEST(word_table, understands_escapes) {
  EXPECT_EQ(find_escaped(words, R"(\u006fp)"), 0U);
  EXPECT_EQ(find_escaped(words, R"(\u0074\u006f\u0070\u0069\u0063)"), 2U);
  EXPECT_EQ(find_escaped(words, R"(o\u0071)"), words.size());
  EXPECT_EQ(find_escaped(words, R"(op\\)"), words.size());
  EXPECT_EQ(find_escaped(words, R"(\u0074)" + std::string(100, 'x')), words.size());
}

} // namespace
} // namespace word_table_test
