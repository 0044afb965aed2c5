// SPDX-License-Identifier: Apache-2.0
#include "service/service_loop.hpp"

#include <gtest/gtest.h>

namespace nap_budget_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;
using rowe::service::nap_budget;

struct run {
  nap_budget budget;
  time_point now{1000s};
  duration slept{}, waited{};
  int forced = 0, waits = 0;

  // One turn of a service thread: works, then rests as service_loop does under idle::spin. A wait ends after
  // `until_event`, if that is sooner than the nap.
  void turn(duration work, duration until_event) {
    now += work;
    budget.awake_until(now);
    if (budget.overdue()) {
      now += nap_budget::nap;
      slept += nap_budget::nap;
      ++forced;
      budget.slept_until(now);
    } else if (budget.due()) {
      const duration rest = std::min(nap_budget::nap, until_event);
      now += rest;
      waited += rest;
      ++waits;
      budget.waited_until(now);
    }
  }
};

TEST(nap_budget, sleeps_a_twelfth_of_every_ten_milliseconds_when_each_wait_ends_at_once) {
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

TEST(nap_budget, only_waits_when_waiting_is_rest_enough) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(30us, 1s);
  EXPECT_EQ(r.forced, 0);
  EXPECT_GE(r.waited * 100 / (r.now - time_point{1000s}), 8);
}

TEST(nap_budget, waits_once_in_a_nap_when_each_answer_is_followed_by_the_next_question) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(7us, 13us);
  EXPECT_GT(r.forced, 0);
  EXPECT_LE(r.waits, r.forced + 2);
  EXPECT_GE((r.slept + r.waited) * 100 / (r.now - time_point{1000s}), 8);
}

TEST(nap_budget, waits_again_when_the_questions_have_ended) {
  run r;
  for (int i = 0; i < 100'000; ++i) r.turn(7us, 13us);
  const int before = r.forced;
  for (int i = 0; i < 100'000; ++i) r.turn(30us, 1s);
  EXPECT_LE(r.forced, before + 8);
}

TEST(nap_budget, owes_no_more_than_a_few_naps_after_a_long_turn) {
  run r;
  r.turn(10s, 1us);
  for (int i = 0; i < 20; ++i) r.turn(1us, 1s);
  EXPECT_LE(r.forced, 8);
}

TEST(nap_budget, begins_without_debt) {
  nap_budget budget;
  budget.awake_until(time_point{1000s});
  EXPECT_FALSE(budget.due());
}

} // namespace
} // namespace nap_budget_test
