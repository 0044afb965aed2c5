// SPDX-License-Identifier: Apache-2.0
// How regularly a loop runs, as the service thread reads it while the loop writes.
#include <rowe/detail/loop_timing.hpp>

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <thread>

#include <rowe/detail/stop_permit.hpp>

namespace loop_timing_test {
namespace {

using namespace std::chrono_literals;
using rowe::detail::loop_timing;
using rowe::rt::duration;
using rowe::rt::time_point;

constexpr time_point at(duration since) { return time_point{1s + since}; }

TEST(loop_timing, is_of_the_times_from_one_look_to_the_next) {
  const auto timing = std::make_unique<loop_timing>();
  timing->note({}, at(0ms)); // the first look ends no cycle
  EXPECT_EQ(timing->cycles().count(), 0U);
  timing->note(at(0ms), at(1ms));
  timing->note(at(1ms), at(4ms));
  EXPECT_EQ(timing->cycles().count(), 2U);
  EXPECT_EQ(timing->cycles().min(), 1ms);
  EXPECT_EQ(timing->cycles().max(), 3ms);
}

TEST(loop_timing, counts_a_time_that_does_not_rise_as_none) {
  const auto timing = std::make_unique<loop_timing>();
  timing->note(at(5ms), at(5ms));
  timing->note(at(5ms), at(2ms));
  EXPECT_EQ(timing->cycles().count(), 2U);
  EXPECT_EQ(timing->cycles().max(), 0ms);
}

TEST(loop_timing, is_read_by_another_thread_while_the_loop_runs) {
  const auto timing = std::make_unique<loop_timing>();
  rowe::detail::permit_word<> permit;
  rowe::detail::latch_words<> words;
  constexpr std::uint64_t cycles = 200'000;
  std::atomic<bool> done{false};
  std::jthread loop{[&] {
    rowe::detail::latch_memory own;
    time_point now = at(0ms);
    for (std::uint64_t i = 0; i <= cycles; ++i, now += i % 100 == 0 ? 3ms : 1ms) {
      timing->note(words.checked_in(), now);
      (void)rowe::detail::latch_engaged(permit, words, own, now);
    }
    done = true;
  }};
  std::uint64_t before = 0;
  while (!done) {
    const std::uint64_t count = timing->cycles().count();
    ASSERT_GE(count, before);
    before = count;
    constexpr std::array percents{50.0, 99.9};
    std::array<duration, percents.size()> found;
    timing->cycles().percentiles(percents, found);
    ASSERT_LE(found[0], 1ms + duration{1ms} / 128);
    ASSERT_LE(found[0], found[1]);
    ASSERT_LE(found[1], 3ms + duration{3ms} / 128);
  }
  loop.join();
  EXPECT_EQ(timing->cycles().count(), cycles);
  EXPECT_GE(timing->cycles().percentile(50), 1ms);
  EXPECT_GE(timing->cycles().percentile(99.9), 3ms);
  EXPECT_EQ(timing->cycles().max(), 3ms);
}

} // namespace
} // namespace loop_timing_test
