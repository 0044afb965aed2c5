// SPDX-License-Identifier: Apache-2.0
#include <rowe/result.hpp>

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>

namespace result_test {
namespace {

using rowe::errc;

TEST(error, renders_its_sentence_with_the_value_and_the_limit) {
  std::array<char, 128> room;
  EXPECT_EQ((rowe::error{errc::too_big, 5120, 4096}.text(room)), "5120 bytes exceed the limit of 4096 bytes");
  EXPECT_EQ((rowe::error{errc::full, 0, 64}.name()), "full");
}

TEST(error, cuts_its_sentence_where_the_room_ends) {
  const rowe::error what{errc::too_big, 5120, 4096};
  std::array<char, 128> whole;
  const std::string sentence{what.text(whole)};
  for (std::size_t room = 0; room < sentence.size(); ++room) {
    std::array<char, 128> some;
    const auto text = what.text(std::span{some}.first(room));
    EXPECT_LE(text.size(), room);
    EXPECT_EQ(text, sentence.substr(0, text.size()));
  }
}

TEST(result, holds_a_value_or_an_error) {
  const rowe::result<int> good = 7;
  EXPECT_TRUE(good);
  EXPECT_EQ(*good, 7);
  const rowe::result<int> bad = errc::closed;
  EXPECT_FALSE(bad);
  EXPECT_EQ(bad.code(), errc::closed);
}

TEST(result, holds_what_can_only_be_moved) {
  rowe::result<std::unique_ptr<int>> held = std::make_unique<int>(3);
  EXPECT_EQ(*std::move(held).value(), 3);
}

TEST(result, throws_its_sentence_where_value_is_asked_for_without_one) {
  const rowe::result<int> bad = rowe::error{errc::address_in_use, 8080};
  try {
    (void)bad.value();
    FAIL() << "nothing was thrown";
  } catch (const rowe::bad_result& thrown) {
    EXPECT_STREQ(thrown.what(), "port 8080 is in use by another program");
    EXPECT_EQ(thrown.reason().code, errc::address_in_use);
  }
}

TEST(status, is_success_unless_it_is_an_error) {
  EXPECT_TRUE(rowe::status{});
  EXPECT_FALSE(rowe::status{errc::full});
  EXPECT_THROW(rowe::status{errc::full}.value(), rowe::bad_result);
}

} // namespace
} // namespace result_test
