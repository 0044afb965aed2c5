// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/plot/envelope.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace rowe::tools {
namespace envelope_test {
namespace {

// The same from all samples: of each column the places of the first, last, lowest and highest one.
std::vector<sample> by_brute_force(const std::vector<sample>& all, std::int64_t column_ns,
                                   std::size_t columns) {
  std::map<std::size_t, std::vector<std::size_t>> in;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto column = static_cast<std::size_t>(std::max<std::int64_t>(all[i].time_ns / column_ns, 0));
    in[std::min(column, columns - 1)].push_back(i);
  }
  std::vector<sample> kept;
  for (const auto& [column, places] : in) {
    const auto less = [&](std::size_t one, std::size_t other) { return all[one].value < all[other].value; };
    const auto more = [&](std::size_t one, std::size_t other) { return all[one].value > all[other].value; };
    std::vector<std::size_t> four{places.front(), places.back(),
                                  *std::min_element(places.begin(), places.end(), less),
                                  *std::min_element(places.begin(), places.end(), more)};
    std::sort(four.begin(), four.end());
    four.erase(std::unique(four.begin(), four.end()), four.end());
    for (const std::size_t one : four) kept.push_back(all[one]);
  }
  return kept;
}

bool is_same(const sample& one, const sample& other) {
  return one.time_ns == other.time_ns && one.value == other.value && one.other == other.other;
}

TEST(an_envelope, keeps_first_last_lowest_and_highest_of_each_column) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937_64 random{seed};
  for (int round = 0; round < 300; ++round) {
    constexpr std::int64_t column_ns = 1 << 20;
    const auto columns = static_cast<std::size_t>(random() % 40 + 1);
    envelope from{0, column_ns * static_cast<std::int64_t>(columns), columns};
    std::vector<sample> all(random() % 2000);
    for (sample& one : all) {
      one.time_ns = static_cast<std::int64_t>(random() % (column_ns * columns));
      one.value = static_cast<double>(random() % 50); // many are equal
      one.other = static_cast<double>(random() % 1000);
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const sample& one, const sample& other) { return one.time_ns < other.time_ns; });
    for (const sample& one : all) from.add(one);
    const auto kept = from.kept(), wanted = by_brute_force(all, column_ns, columns);
    ASSERT_TRUE(std::equal(kept.begin(), kept.end(), wanted.begin(), wanted.end(), is_same));
    ASSERT_LE(kept.size(), columns * 4);
    ASSERT_EQ(from.samples(), all.size());
  }
}

TEST(an_envelope, knows_the_lowest_and_the_highest_of_all) {
  envelope from{0, 100, 3};
  for (const double value : {3.0, -2.0, 7.0, 0.0}) from.add({.time_ns = 50, .value = value});
  EXPECT_EQ(from.lowest(), -2);
  EXPECT_EQ(from.highest(), 7);
}

TEST(an_envelope, takes_what_lies_outside_of_its_time) {
  envelope from{100, 200, 4};
  for (const std::int64_t time :
       {INT64_MIN, std::int64_t{0}, std::int64_t{100}, std::int64_t{200}, INT64_MAX})
    from.add({.time_ns = time, .value = static_cast<double>(time)});
  EXPECT_EQ(from.samples(), 5U);
  EXPECT_EQ(from.kept().front().time_ns, INT64_MIN);
  EXPECT_EQ(from.kept().back().time_ns, INT64_MAX);
}

TEST(an_envelope, of_a_moment_keeps_what_is_there) {
  envelope from{5, 5, 10};
  from.add({.time_ns = 5, .value = 1});
  ASSERT_EQ(from.kept().size(), 1U);
  EXPECT_TRUE(envelope(0, 10, 0).kept().empty());
}

} // namespace
} // namespace envelope_test
} // namespace rowe::tools
