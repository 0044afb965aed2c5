// SPDX-License-Identifier: Apache-2.0
// The histogram against the sorted list of what was recorded, its edges, its texts, and a reader beside the
// writer.
#include <rowe/rt/histogram.hpp>

#include "seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace histogram_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::counter;
using rowe::rt::duration;
using rowe::rt::histogram;
using rowe::rt::inline_histogram;

std::string percentiles(const histogram& h) {
  std::string text;
  h.write_percentiles([&](std::string_view piece) { text += piece; });
  return text;
}
std::string bars(const histogram& h) {
  std::string text;
  h.write_bars([&](std::string_view piece) { text += piece; });
  return text;
}

TEST(histogram, says_zero_while_nothing_is_recorded) {
  inline_histogram<> h;
  EXPECT_EQ(h.count(), 0u);
  EXPECT_EQ(h.min(), 0ns);
  EXPECT_EQ(h.max(), 0ns);
  EXPECT_EQ(h.mean(), 0ns);
  EXPECT_EQ(h.percentile(99.9), 0ns);
  EXPECT_EQ(bars(h), "");
}

TEST(histogram, has_counters_that_follow_each_other_without_gap_or_overlap) {
  for (unsigned bits = histogram::precision_bits_min; bits <= histogram::precision_bits_max; ++bits) {
    const std::size_t count = histogram::counters_needed(bits);
    for (std::size_t index = 0; index < count; ++index) {
      const std::uint64_t lowest = histogram::lowest_of(index, bits);
      const std::uint64_t highest = histogram::highest_of(index, bits);
      ASSERT_EQ(histogram::index_of(lowest, bits), index);
      ASSERT_EQ(histogram::index_of(highest, bits), index);
      ASSERT_EQ(histogram::index_of(highest + 1, bits), index + 1);
      ASSERT_LE((highest - lowest) << bits, lowest) << "wider than the stated error";
    }
    EXPECT_GE(histogram::highest_of(count - 1, bits), static_cast<std::uint64_t>(histogram::value_max));
  }
}

TEST(histogram, takes_the_memory_that_its_header_states) {
  EXPECT_EQ(histogram::counters_needed(5), 1016u);
  EXPECT_EQ(histogram::counters_needed(7), 3808u);
}

TEST(histogram, gives_percentiles_that_are_never_too_small_and_too_large_by_the_stated_error_at_most) {
  rowe::tests::seeded random;
  inline_histogram<5> coarse;
  inline_histogram<9> fine;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 20'000; ++i) {
    const auto value = static_cast<std::int64_t>(random() >> (29 + random() % 35));
    const std::int64_t ns = std::min(value, histogram::value_max);
    values.push_back(ns);
    coarse.record(duration{ns});
    fine.record(duration{ns});
  }
  std::sort(values.begin(), values.end());
  for (const double percent : {0.0, 0.01, 1.0, 10.0, 50.0, 90.0, 99.0, 99.9, 99.99, 100.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * static_cast<double>(values.size())));
    const std::int64_t truth = values[std::max<std::size_t>(rank, 1) - 1];
    for (const auto& [h, bits] : {std::pair<const histogram*, unsigned>{&coarse, 5}, {&fine, 9}}) {
      EXPECT_GE(h->percentile(percent).count(), truth) << percent;
      EXPECT_LE(h->percentile(percent).count(), truth + (truth >> bits)) << percent;
    }
  }
  EXPECT_EQ(coarse.percentile(100), coarse.max());
  EXPECT_EQ(coarse.min().count(), values.front());
  EXPECT_EQ(coarse.max().count(), values.back());
}

TEST(histogram, gives_several_percentiles_at_once_as_one_after_the_other) {
  rowe::tests::seeded random;
  inline_histogram<> empty, one, many;
  one.record(3ms);
  for (int i = 0; i < 10'000; ++i)
    many.record(duration{static_cast<std::int64_t>(random() >> (28 + random() % 36))});
  constexpr std::array percents{-1.0, 0.0, 50.0, 50.0, 99.0, 99.9, 100.0, 101.0};
  for (const histogram* h : {&empty, &one, &many}) {
    std::array<duration, percents.size()> found;
    h->percentiles(percents, found);
    for (std::size_t i = 0; i < percents.size(); ++i) EXPECT_EQ(found[i], h->percentile(percents[i]));
  }
}

TEST(histogram, counts_what_is_above_a_minute_as_a_minute_and_as_saturated) {
  inline_histogram<> h;
  h.record(1min);
  EXPECT_EQ(h.saturated(), 0u);
  h.record(1min + 1ns);
  h.record(duration::max());
  EXPECT_EQ(h.saturated(), 2u);
  EXPECT_EQ(h.count(), 3u);
  EXPECT_EQ(h.max(), duration::max());
  EXPECT_GE(h.percentile(100), 1min);
  EXPECT_EQ(h.mean(), 1min) << "what is saturated counts as a minute here too";
}

TEST(histogram, counts_a_negative_duration_as_zero) {
  inline_histogram<> h;
  h.record(-5ms);
  EXPECT_EQ(h.count(), 1u);
  EXPECT_EQ(h.min(), 0ns);
  EXPECT_EQ(h.percentile(50), 0ns);
}

TEST(histogram, records_many_at_once_like_one_after_the_other) {
  inline_histogram<> one, many;
  for (int i = 0; i < 1000; ++i) one.record(12'345ns);
  many.record(12'345ns, 1000);
  EXPECT_EQ(percentiles(one), percentiles(many));
  EXPECT_EQ(many.mean(), 12'345ns);
}

TEST(histogram, forgets_everything_when_cleared) {
  inline_histogram<> h;
  h.record(2min);
  h.clear();
  h.record(7ns);
  EXPECT_EQ(h.count(), 1u);
  EXPECT_EQ(h.min(), 7ns);
  EXPECT_EQ(h.max(), 7ns);
  EXPECT_EQ(h.saturated(), 0u);
}

TEST(histogram, merged_from_two_equals_one_that_recorded_both) {
  inline_histogram<> left, right, both;
  for (int i = 1; i <= 1000; ++i) {
    const duration value{i * i * 97};
    (i % 3 == 0 ? left : right).record(value);
    both.record(value);
  }
  ASSERT_TRUE(left.add(right));
  EXPECT_EQ(percentiles(left), percentiles(both));
  EXPECT_EQ(left.min(), both.min());
  EXPECT_EQ(left.mean(), both.mean());
}

TEST(histogram, refuses_to_merge_another_precision) {
  inline_histogram<5> coarse;
  inline_histogram<7> fine;
  fine.record(1us);
  EXPECT_FALSE(coarse.add(fine));
  EXPECT_EQ(coarse.count(), 0u);
}

TEST(histogram, works_in_memory_of_the_callers) {
  const auto memory = std::make_unique<counter[]>(histogram::counters_needed(3));
  histogram h{{memory.get(), histogram::counters_needed(3)}, 3};
  h.record(1ms);
  EXPECT_EQ(h.percentile(50), 1ms);
  EXPECT_EQ(h.counters().size(), histogram::counters_needed(3));
}

// The format is HdrHistogram's; the numbers were worked out by hand from its definition: levels 0, 0.1, ...
// 0.5, 0.55, ..., the value of the counter that reaches the level, and how many values lie up to there.
TEST(histogram, writes_percentiles_as_hdrhistogram_does) {
  inline_histogram<> h;
  for (int i = 1; i <= 10; ++i) h.record(duration{i});
  std::string text;
  h.write_percentiles([&](std::string_view piece) { text += piece; }, 1ns);
  std::istringstream lines{text};
  std::string line;
  for (const std::string_view expected : {"       Value     Percentile TotalCount 1/(1-Percentile)", "",
                                          "       1.000 0.000000000000          1           1.00",
                                          "       1.000 0.100000000000          1           1.11",
                                          "       2.000 0.200000000000          2           1.25"}) {
    std::getline(lines, line);
    EXPECT_EQ(line, expected);
  }
  std::string last, foot;
  while (std::getline(lines, line)) (line.starts_with('#') ? foot : last) = line;
  EXPECT_EQ(last, "      10.000 1.000000000000         10");
  EXPECT_NE(text.find("\n#[Mean    =        5.500, StdDeviation   =        2.872]\n"
                      "#[Max     =       10.000, Total count    =           10]\n"
                      "#[Buckets =           31, SubBuckets     =           32]\n"),
            std::string::npos)
      << text;
}

TEST(histogram, writes_levels_and_values_that_only_grow) {
  inline_histogram<> h;
  std::mt19937_64 random{7};
  for (int i = 0; i < 100'000; ++i)
    h.record(duration{static_cast<std::int64_t>(random() >> (34 + random() % 20))});
  std::istringstream lines{percentiles(h)};
  std::string line;
  std::getline(lines, line);
  double value = 0, level = -1;
  std::uint64_t passed = 0;
  int rows = 0;
  while (std::getline(lines, line) && !line.starts_with('#')) {
    if (line.empty()) continue;
    std::istringstream row{line};
    double next_value = 0, next_level = 0;
    std::uint64_t next_passed = 0;
    ASSERT_TRUE(row >> next_value >> next_level >> next_passed) << line;
    ASSERT_GE(next_value, value);
    ASSERT_GT(next_level, level);
    ASSERT_GE(next_passed, passed);
    ASSERT_GE(static_cast<double>(next_passed) / 100'000 + 1e-9, next_level);
    value = next_value, level = next_level, passed = next_passed;
    ++rows;
  }
  EXPECT_EQ(level, 1.0);
  EXPECT_EQ(passed, 100'000u);
  EXPECT_GT(rows, 50);
}

TEST(histogram, draws_a_bar_that_is_seen_for_one_value_in_a_million) {
  inline_histogram<> h;
  h.record(10us, 1'000'000);
  h.record(3ms);
  const std::string text = bars(h);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10) << text;
  EXPECT_TRUE(
      text.starts_with("     from |      bar: logarithm of the count       |      count      share\n"
                       "  8.19 µs |########################################|    1000000   99.9999 %\n"))
      << text;
  EXPECT_NE(text.find("  2.10 ms |##"), std::string::npos) << text;
}

TEST(histogram, is_read_by_another_thread_while_one_records) {
  inline_histogram<> h;
  std::atomic<bool> done{false};
  std::thread recording{[&] {
    for (int i = 0; i < 200'000; ++i) h.record(duration{i % 1000 + 1});
    done = true;
  }};
  std::uint64_t before = 0;
  while (!done) {
    const std::uint64_t count = h.count();
    ASSERT_GE(count, before);
    before = count;
    ASSERT_LE(h.percentile(50), 1000ns);
    ASSERT_LE(h.min(), h.max());
    (void)percentiles(h);
  }
  recording.join();
  EXPECT_EQ(h.count(), 200'000u);
  EXPECT_EQ(h.percentile(100), 1000ns);
}

} // namespace
} // namespace histogram_test
