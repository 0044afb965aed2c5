// SPDX-License-Identifier: Apache-2.0
#include "service/core/service_loop.hpp"

#include <gtest/gtest.h>

namespace throttle_avoidance_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;
using rowe::service::throttle_avoidance;

struct run {
  throttle_avoidance guard;
  time_point now{1000s};
  duration slept{}, waited{};
  int forced = 0, waits = 0;

  // One turn of a service thread: works, then rests as service_loop does under idle::spin. A wait ends after
  // `until_event`, if that is sooner than the yield would.
  void turn(duration work, duration until_event) {
    now += work;
    guard.awake_until(now);
    if (guard.overdue()) {
      now += throttle_avoidance::yield_time;
      slept += throttle_avoidance::yield_time;
      ++forced;
      guard.slept_until(now);
    } else if (guard.due()) {
      const duration rest = std::min(throttle_avoidance::yield_time, until_event);
      now += rest;
      waited += rest;
      ++waits;
      guard.waited_until(now);
    }
  }
};

TEST(throttle_avoidance, sleeps_a_twelfth_of_every_ten_milliseconds_when_each_wait_ends_at_once) {
  run r;
  for (int window = 0; window < 200; ++window) {
    const time_point end = r.now + 10ms;
    const duration before = r.slept;
    while (r.now < end) r.turn(30us, 1us);
    if (window == 0) continue; // the debt grows first
    EXPECT_GE(r.slept - before, 700us) << window;
  }
  EXPECT_GE(r.slept * 100 / (r.now - time_point{1000s}), 8);
}

TEST(throttle_avoidance, only_waits_when_waiting_is_rest_enough) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(30us, 1s);
  EXPECT_EQ(r.forced, 0);
  EXPECT_GE(r.waited * 100 / (r.now - time_point{1000s}), 8);
}

TEST(throttle_avoidance, waits_once_for_each_sleep_when_each_answer_is_followed_by_the_next_question) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(7us, 13us);
  EXPECT_GT(r.forced, 0);
  EXPECT_LE(r.waits, r.forced + 2);
  EXPECT_GE((r.slept + r.waited) * 100 / (r.now - time_point{1000s}), 8);
}

TEST(throttle_avoidance, waits_again_when_the_questions_have_ended) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(7us, 13us);
  const int before = r.forced;
  for (int i = 0; i < 100'000; ++i) r.turn(30us, 1s);
  EXPECT_LE(r.forced, before + 8);
}

TEST(throttle_avoidance, owes_no_more_than_a_few_yields_after_a_long_turn) {
  run r;
  r.turn(10s, 1us);
  for (int i = 0; i < 20; ++i) r.turn(1us, 1s);
  EXPECT_LE(r.forced, 8);
}

TEST(throttle_avoidance, begins_without_debt) {
  throttle_avoidance guard;
  guard.awake_until(time_point{1000s});
  EXPECT_FALSE(guard.due());
}

} // namespace
} // namespace throttle_avoidance_test
