// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/plot/ticks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

namespace rowe::tools {
namespace ticks_test {
namespace {

std::vector<std::string> labels(double low, double high, std::size_t most) {
  std::vector<std::string> all;
  for (const tick& one : ticks_between(low, high, most)) all.push_back(one.label);
  return all;
}
using words = std::vector<std::string>;

TEST(ticks, are_at_multiples_of_1_2_or_5) {
  EXPECT_EQ(labels(0, 10, 6), (words{"0", "2", "4", "6", "8", "10"}));
  EXPECT_EQ(labels(0, 10, 11), (words{"0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"}));
  EXPECT_EQ(labels(-0.3, 0.3, 5), (words{"-0.2", "0", "0.2"}));
  EXPECT_EQ(labels(997, 1013, 4), (words{"1000", "1005", "1010"}));
}

TEST(ticks, have_an_exponent_where_they_would_be_long) {
  EXPECT_EQ(labels(0, 4e9, 5), (words{"0", "1e9", "2e9", "3e9", "4e9"}));
  EXPECT_EQ(labels(0, 2.5e-9, 3), (words{"0", "1e-9", "2e-9"}));
  EXPECT_EQ(labels(1.5e9, 1.502e9, 3), (words{"1.500e9", "1.501e9", "1.502e9"}));
}

TEST(ticks, are_in_range_in_order_no_more_than_asked_for_and_told_apart) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937_64 random{seed};
  std::uniform_real_distribution<double> power{-12, 12}, share{-1, 1};
  std::uniform_int_distribution<std::size_t> count{1, 20};
  for (int i = 0; i < 20'000; ++i) {
    const double size = std::pow(10, power(random)), middle = share(random) * size * 10;
    const double low = middle - size, high = middle + size;
    const std::size_t most = count(random);
    const auto all = ticks_between(low, high, most);
    ASSERT_LE(all.size(), most) << low << " " << high;
    if (most >= 3) {
      ASSERT_GE(all.size(), 1U) << low << " " << high << " " << most;
    }
    std::set<std::string> seen;
    for (std::size_t k = 0; k < all.size(); ++k) {
      ASSERT_GE(all[k].at, low - size * 1e-6);
      ASSERT_LE(all[k].at, high + size * 1e-6);
      if (k > 0) {
        ASSERT_LT(all[k - 1].at, all[k].at);
      }
      ASSERT_TRUE(seen.insert(all[k].label).second) << all[k].label << " " << low << " " << high;
      ASSERT_NEAR(std::stod(all[k].label), all[k].at, size * 1e-6);
    }
  }
}

TEST(ticks, are_none_where_there_is_no_range) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(ticks_between(1, 1, 5).empty());
  EXPECT_TRUE(ticks_between(2, 1, 5).empty());
  EXPECT_TRUE(ticks_between(0, infinity, 5).empty());
  EXPECT_TRUE(ticks_between(0, std::nan(""), 5).empty());
  EXPECT_TRUE(ticks_between(0, 1, 0).empty());
  EXPECT_TRUE(ticks_between(1e15, std::nextafter(1e15, 2e15), 5).empty());
}

TEST(ticks, of_the_largest_numbers_are_finite) {
  const axis_range all = with_air(-8e307, 8e307);
  for (const tick& one : ticks_between(all.low, all.high, 5)) EXPECT_TRUE(std::isfinite(one.at));
  EXPECT_TRUE(std::isfinite(all.high - all.low));
}

TEST(a_range_with_air, holds_all_and_is_no_single_value) {
  for (const auto& [low, high] : {std::pair{0.0, 0.0}, {3.0, 3.0}, {-7.0, -7.0}, {1.0, 2.0}, {-1e-9, 1e-9}}) {
    const axis_range air = with_air(low, high);
    EXPECT_LT(air.low, low);
    EXPECT_GT(air.high, high);
  }
}

} // namespace
} // namespace ticks_test
} // namespace rowe::tools
