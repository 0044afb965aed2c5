// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/clock.hpp>

#include <gtest/gtest.h>

#include <string_view>

namespace clock_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::deadline_after;
using rowe::rt::never;
using rowe::rt::time_point;

TEST(clock, never_goes_back) {
  time_point before = rowe::rt::monotonic_clock::now();
  for (int i = 0; i < 10'000; ++i) {
    const time_point now = rowe::rt::monotonic_clock::now();
    ASSERT_GE(now, before);
    before = now;
  }
}

TEST(clock, gives_deadlines_that_do_not_overflow) {
  const time_point now{5s};
  EXPECT_EQ(deadline_after(now, 2s), time_point{7s});
  EXPECT_EQ(deadline_after(now, 0s), now);
  EXPECT_EQ(deadline_after(now, -1ns), never);
  EXPECT_EQ(deadline_after(now, rowe::rt::for_ever), never);
  EXPECT_EQ(deadline_after(now, never - now), never);
  EXPECT_EQ(deadline_after(now, never - now - 1ns), never - 1ns);
}

TEST(clock, measures_what_a_reading_costs) {
  const rowe::rt::clock_cost cost = rowe::rt::clock_is_cheap();
  EXPECT_GT(cost.read, 0ns);
  EXPECT_GT(cost.system_call, 0ns);
  EXPECT_EQ(std::string_view{cost.source}.find('\n'), std::string_view::npos);
  const std::string_view source{cost.source};
  EXPECT_TRUE(!cost.cheap || source == "tsc" || source == "arch_sys_counter");
  EXPECT_EQ(static_cast<bool>(cost), cost.cheap);
}

} // namespace
} // namespace clock_test
