// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/recordings/playback_clock.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace rowe::tools {
namespace playback_clock_test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t recorded = 1'764'475'798'000'000'000;
constexpr rt::time_point now{1000s};
constexpr std::int64_t in(rt::duration after) { return recorded + after.count(); }

playback_clock begun(double rate) {
  playback_clock clock{rate};
  clock.set(recorded, now);
  return clock;
}

TEST(playback_clock, counts_each_time_from_one_anchor) {
  const playback_clock clock = begun(1);
  EXPECT_EQ(clock.due(recorded), now);
  EXPECT_EQ(clock.due(in(1h + 1ns)), now + 1h + 1ns);
  EXPECT_EQ(clock.due(in(-1s)), now - 1s);
  EXPECT_EQ(clock.position(now + 5s), in(5s));
}

TEST(playback_clock, is_faster_or_slower_by_its_rate) {
  EXPECT_EQ(begun(2).due(in(1h)), now + 30min);
  EXPECT_EQ(begun(0.5).due(in(1h)), now + 2h);
  EXPECT_EQ(begun(0.5).position(now + 2s), in(1s));
}

TEST(playback_clock, never_overflows) {
  EXPECT_EQ(begun(0.001).due(INT64_MAX), rt::never);
  EXPECT_LT(begun(0.001).due(0), now);
  playback_clock clock{1};
  clock.set(0, now);
  EXPECT_EQ(clock.due(INT64_MAX), rt::never);
}

TEST(playback_clock, stands_while_it_pauses) {
  playback_clock clock = begun(2);
  clock.pause(now + 1s);
  EXPECT_TRUE(clock.paused());
  EXPECT_EQ(clock.position(now + 1h), in(2s));
  clock.resume(now + 1h);
  EXPECT_FALSE(clock.paused());
  EXPECT_EQ(clock.due(in(4s)), now + 1h + 1s);
}

TEST(playback_clock, goes_on_where_it_was_broken_off) {
  playback_clock clock = begun(1);
  clock.shift(10s);
  EXPECT_EQ(clock.due(in(1s)), now + 11s);
}

TEST(playback_clock, begins_each_lap_where_the_last_one_ends) {
  playback_clock clock = begun(2);
  for (int laps = 1; laps <= 1000; ++laps) {
    clock.begin_lap(recorded, in(3s));
    ASSERT_EQ(clock.due(recorded), now + laps * 1500ms);
  }
}

} // namespace
} // namespace playback_clock_test
} // namespace rowe::tools
