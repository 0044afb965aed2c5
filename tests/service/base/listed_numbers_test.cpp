// SPDX-License-Identifier: Apache-2.0
#include "service/base/listed_numbers.hpp"

#include <gtest/gtest.h>

#include <set>

namespace listed_numbers_test {
namespace {

using rowe::service::listed_numbers;

TEST(listed_numbers, begin_anew_behind_the_last_one_and_pass_over_those_in_use) {
  listed_numbers all{64, UINT32_MAX - 3};
  const std::set<std::uint32_t> used{64, 65, 67};
  const auto in_use = [&](std::uint32_t number) { return used.contains(number); };
  EXPECT_EQ(all.take(in_use), UINT32_MAX - 2);
  EXPECT_EQ(all.take(in_use), UINT32_MAX - 1);
  EXPECT_EQ(all.take(in_use), 66U);
  EXPECT_EQ(all.take(in_use), 68U);
  EXPECT_EQ(all.newest(), 68U);
}

TEST(listed_numbers, are_newer_also_behind_the_end) {
  EXPECT_TRUE(listed_numbers::is_newer(66, UINT32_MAX - 1));
  EXPECT_FALSE(listed_numbers::is_newer(UINT32_MAX - 1, 66));
  EXPECT_FALSE(listed_numbers::is_newer(5, 5));
}

} // namespace
} // namespace listed_numbers_test
