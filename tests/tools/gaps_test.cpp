// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/plot/gaps.hpp"

#include <gtest/gtest.h>

#include <random>

namespace rowe::tools {
namespace gaps_test {
namespace {

constexpr std::int64_t ms = 1'000'000;

TEST(gaps, are_what_is_longer_than_four_usual_pauses) {
  gap_finder from;
  std::int64_t now = 0;
  for (int i = 0; i < 100; ++i) from.add(now += 50 * ms);
  from.add(now += 190 * ms);
  const std::int64_t begin = now;
  from.add(now += 300 * ms);
  for (int i = 0; i < 100; ++i) from.add(now += 50 * ms);
  const auto found = from.gaps();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].begin_ns, begin);
  EXPECT_EQ(found[0].end_ns, begin + 300 * ms);
}

TEST(gaps, are_not_what_any_busy_machine_has) {
  gap_finder from;
  std::int64_t now = 0;
  for (int i = 0; i < 100; ++i) from.add(now += 1 * ms);
  from.add(now += 99 * ms);
  EXPECT_TRUE(from.gaps().empty());
  from.add(now += 100 * ms);
  EXPECT_EQ(from.gaps().size(), 1U);
}

TEST(gaps, of_messages_that_come_in_bursts_are_not_the_pauses_between_these) {
  gap_finder from;
  std::int64_t now = 0;
  for (int burst = 0; burst < 50; ++burst) {
    now += 40 * ms;
    for (int i = 0; i < 4; ++i) from.add(now + i);
  }
  EXPECT_TRUE(from.gaps().empty());
  from.add(now + 400 * ms);
  EXPECT_EQ(from.gaps().size(), 1U);
}

TEST(gaps, are_unknown_where_little_came) {
  gap_finder from;
  EXPECT_TRUE(from.gaps().empty());
  for (const std::int64_t time : {0, 1, 2, 3, 1000}) from.add(time * ms);
  EXPECT_TRUE(from.gaps().empty());
}

TEST(gaps, are_the_longest_ones_where_there_are_too_many) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937_64 random{seed};
  gap_finder from;
  std::int64_t now = 0;
  std::vector<std::int64_t> lengths;
  for (int i = 0; i < 50'000; ++i) {
    from.add(now += 10 * ms);
    if (i % 20 != 19) continue;
    lengths.push_back(static_cast<std::int64_t>(random() % 1'000 + 50) * ms);
    from.add(now += lengths.back());
  }
  const auto found = from.gaps();
  ASSERT_EQ(found.size(), gap_finder::kept_max);
  std::sort(lengths.begin(), lengths.end(), std::greater{});
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_GE(found[i].length_ns(), lengths[gap_finder::kept_max - 1]);
    if (i > 0) {
      EXPECT_LE(found[i - 1].end_ns, found[i].begin_ns);
    }
  }
}

TEST(gaps, bear_times_that_stand_still_or_go_far) {
  gap_finder from;
  for (int i = 0; i < 20; ++i) from.add(5);
  from.add(INT64_MAX);
  EXPECT_EQ(from.gaps().size(), 1U);
}

} // namespace
} // namespace gaps_test
} // namespace rowe::tools
