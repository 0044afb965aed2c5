// SPDX-License-Identifier: Apache-2.0
#include <rowe/result.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>

namespace result_test {
namespace {

using rowe::errc;

TEST(error, renders_its_diagnostic_with_the_value_and_the_limit) {
  const rowe::error what{errc::too_big, 5120, 4096};
  std::array<char, 128> buffer;
  EXPECT_EQ(what.message(), "5120 bytes exceed the limit of 4096 bytes");
  EXPECT_EQ(what.message(buffer), what.message());
  EXPECT_EQ((rowe::error{errc::full, 0, 64}.name()), "full");
}

TEST(error, cuts_its_diagnostic_where_the_buffer_ends) {
  const rowe::error what{errc::too_big, 5120, 4096};
  std::array<char, 128> whole;
  const std::string diagnostic{what.message(whole)};
  for (std::size_t capacity = 0; capacity < diagnostic.size(); ++capacity) {
    std::array<char, 128> some;
    const auto text = what.message(std::span{some}.first(capacity));
    EXPECT_LE(text.size(), capacity);
    EXPECT_EQ(text, diagnostic.substr(0, text.size()));
  }
}

TEST(error, has_room_for_each_diagnostic_with_the_longest_numbers) {
  constexpr auto least = std::numeric_limits<std::int64_t>::min();
  std::array<char, 1024> buffer;
  for (int code = 0; code <= static_cast<int>(errc::misuse); ++code) {
    for (std::size_t about = 0; about < std::size(rowe::detail::argument_names); ++about) {
      const rowe::error worst{static_cast<errc>(code), least, least, static_cast<rowe::argument>(about),
                              std::numeric_limits<std::uint32_t>::max()};
      EXPECT_EQ(worst.message(), worst.message(buffer));
    }
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

TEST(result, moves_its_value_out_of_a_temporary_only) {
  const auto made = [] { return rowe::result<std::unique_ptr<int>>{std::make_unique<int>(3)}; };
  const std::unique_ptr<int> by_star = *made();
  EXPECT_EQ(*by_star, 3);
  auto held = made();
  std::unique_ptr<int>& value = held.value();
  EXPECT_EQ(&value, &*held);
  *value = 4;
  EXPECT_EQ(**held, 4);
}

TEST(result, is_usable_where_constants_are) {
  constexpr rowe::result<int> good = 7;
  static_assert(good && good.has_value() && *good == 7 && good.value() == 7);
  constexpr rowe::result<int> bad = errc::full;
  static_assert(!bad && bad.code() == errc::full && bad.error().limit == 0);
}

TEST(result, throws_its_diagnostic_where_value_is_asked_for_without_one) {
  const rowe::result<int> bad = rowe::error{errc::address_in_use, 8080};
  try {
    (void)bad.value();
    FAIL() << "nothing was thrown";
  } catch (const rowe::bad_result& thrown) {
    EXPECT_STREQ(thrown.what(), "port 8080 is in use by another program");
    EXPECT_EQ(thrown.error().code, errc::address_in_use);
  }
}

TEST(status, is_a_result_of_nothing_to_whoever_does_not_know_the_type) {
  static_assert(std::is_void_v<decltype(*rowe::status{})>);
  *rowe::status{};
  rowe::status{}.value();
}

TEST(status, is_success_unless_it_is_an_error) {
  EXPECT_TRUE(rowe::status{});
  EXPECT_FALSE(rowe::status{errc::full});
  EXPECT_THROW(rowe::status{errc::full}.value(), rowe::bad_result);
}

} // namespace
} // namespace result_test
