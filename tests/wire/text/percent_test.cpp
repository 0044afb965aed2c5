// SPDX-License-Identifier: Apache-2.0
#include "wire/text/percent.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace rowe::wire {
namespace percent_test {
namespace {

std::string undone(std::string_view text, char plus = '+') {
  std::array<char, 8> out;
  const auto all = undo_percent(out, text, plus);
  return all ? std::string{*all} : "nothing";
}

TEST(undo_percent, writes_what_stands_behind_each_percent_sign) {
  EXPECT_EQ(undone("a%2Fb%2f%41"), "a/b/A");
  EXPECT_EQ(undone("%C3%b6"), "\303\266");
  EXPECT_EQ(undone("%00"), (std::string{"\0", 1}));
  EXPECT_EQ(undone("%2541"), "%41") << "once";
  EXPECT_EQ(undone("a+b"), "a+b");
  EXPECT_EQ(undone("a+b%2B", ' '), "a b+") << "of a form";
  EXPECT_EQ(undone(""), "");
}

TEST(undo_percent, refuses_a_percent_sign_without_two_digits) {
  for (const std::string_view text : {"%", "a%", "%4", "a%4", "%4g", "%g4", "%%41", "% 4"})
    EXPECT_EQ(undone(text), "nothing") << text;
}

TEST(undo_percent, writes_no_more_than_there_is_room_for) {
  EXPECT_EQ(undone("12345678%39"), "12345678");
  EXPECT_EQ(undone("1234567%389"), "12345678");
}

} // namespace
} // namespace percent_test
} // namespace rowe::wire
