// SPDX-License-Identifier: Apache-2.0
// The plan of idle::phase on a clock that is moved by hand: publishers whose every time is known, and a
// service thread that looks, watches and sleeps as service_loop does, and wakes up late as kernels do.
#include "service/topics/publish_predictor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <rowe/rt/arena.hpp>

namespace publish_predictor_test {
namespace {

using namespace std::chrono_literals;
using rowe::priority;
using rowe::rt::duration;
using rowe::rt::time_point;
using rowe::service::counter;
using rowe::service::publish_predictor;

constexpr duration poll_period = 250us;
constexpr duration turn = 600ns;  // of a service thread that finds nothing
constexpr duration sending = 5us; // and what a value takes it
constexpr time_point begin{1000s};

class random_numbers {
 public:
  explicit random_numbers(std::uint64_t seed) : state_{seed} {}
  duration below(duration bound) { // a splitmix64
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return duration{
        static_cast<std::int64_t>((z ^ (z >> 31)) % static_cast<std::uint64_t>(bound.count() + 1))};
  }

 private:
  std::uint64_t state_;
};

struct publisher {
  duration declared = 1ms;
  duration real = 1ms; // between two of its times
  duration spread{};   // by how much it may be late for one
  duration computes{}; // from its time to publishing
  priority rank = priority::normal;
  time_point due = begin;                              // its next time
  time_point pause_at = time_point::max(), pause_to{}; // publishes nothing in between
  // Filled in by the world.
  time_point stamp{}, comes{};
  std::vector<duration> waited{}; // each value, until it was found
};

struct world {
  explicit world(std::vector<publisher> all)
      : publishers{std::move(all)}, plan{memory, rowe::limits{}, counts} {
    for (std::uint32_t i = 0; i < publishers.size(); ++i) {
      plan.begin({i}, publishers[i].declared, publishers[i].rank);
      plan.listen({i}, true);
      schedule(publishers[i], publishers[i].due);
    }
  }

  void schedule(publisher& p, time_point when) {
    if (when >= p.pause_at && when < p.pause_to) when = p.pause_to;
    p.due = when;
    p.stamp = when + chance.below(p.spread);
    p.comes = p.stamp + p.computes;
  }

  // A cycle of the core, and its wait.
  void go() {
    const time_point began = now;
    plan.looks(now);
    const time_point looked = now + 200ns;
    duration took = turn;
    for (std::uint32_t i = 0; i < publishers.size(); ++i) {
      publisher& p = publishers[i];
      while (p.comes <= looked) {
        plan.saw({i}, p.stamp);
        p.waited.push_back(looked - p.comes);
        took += sending;
        schedule(p, p.due + p.real);
      }
    }
    now += took;
    if (watching) watched.emplace_back(began, now);
    const time_point until = plan.wait_until(now, poll_period);
    watching = until <= now;
    if (watching) return;
    ++sleeps;
    now = until + 15us + chance.below(20us);
    plan.woke(until, now);
  }
  void run(duration how_long) {
    for (const time_point end = now + how_long; now < end;) go();
  }

  std::uint64_t count(counter which) const { return counts.read(which); }
  // Of the values that came since the last call.
  double hit_percent() {
    const std::uint64_t hits = count(counter::phase_hits) - hits_before;
    const std::uint64_t misses = count(counter::phase_misses) - misses_before;
    hits_before += hits;
    misses_before += misses;
    return 100 * static_cast<double>(hits) / static_cast<double>(hits + misses);
  }
  // In any 100 ms.
  duration watched_max() const {
    duration most{}, sum{};
    std::size_t first = 0;
    for (const auto& [from, to] : watched) {
      sum += to - from;
      for (; to - watched[first].second > 100ms; ++first) sum -= watched[first].second - watched[first].first;
      most = std::max(most, sum);
    }
    return most;
  }

  std::vector<publisher> publishers;
  rowe::rt::arena memory{publish_predictor::footprint_bytes(rowe::limits{}), rowe::rt::page_lock::none};
  rowe::service::counters counts;
  publish_predictor plan;
  random_numbers chance{1};
  time_point now = begin;
  bool watching = false;
  std::uint64_t sleeps = 0, hits_before = 0, misses_before = 0;
  std::vector<std::pair<time_point, time_point>> watched;
};

duration median(std::vector<duration> of) {
  std::sort(of.begin(), of.end());
  return of[of.size() / 2];
}

constexpr duration soon = 1us; // found by a thread that is awake

TEST(publish_predictor, polls_until_eight_values_came_a_period_apart) {
  world w{{{}}};
  w.run(7500us); // the eighth is due at 7 ms
  EXPECT_EQ(w.count(counter::phase_misses), 8u);
  EXPECT_TRUE(w.watched.empty());
  EXPECT_GT(w.sleeps, 24u);
  w.run(1ms);
  EXPECT_EQ(w.count(counter::phase_hits), 1u);
}

TEST(publish_predictor, costs_what_polling_does_where_no_period_is_known) {
  world w{{}};
  EXPECT_EQ(w.plan.listened(), 0u);
  EXPECT_EQ(w.plan.wait_until(w.now, poll_period), rowe::rt::never);
}

TEST(publish_predictor, is_awake_for_values_that_come_on_time_and_sleeps_once_for_each) {
  for (const duration spread : {0us, 20us}) {
    world w{{{.spread = spread}}};
    w.run(100ms);
    (void)w.hit_percent();
    const std::uint64_t slept = w.sleeps;
    w.run(10s);
    EXPECT_GT(w.hit_percent(), 99.5);
    EXPECT_LT(w.sleeps - slept, 10'100u);
    EXPECT_LT(median(w.publishers[0].waited), soon);
    EXPECT_LT(w.count(counter::phase_watched_ns), 300'000'000u);
  }
}

TEST(publish_predictor, is_awake_for_values_that_spread_as_far_as_its_budget_reaches) {
  world w{{{.spread = 100us}}};
  w.run(10s);
  EXPECT_GT(w.hit_percent(), 98);
  world wide{{{.spread = 300us}}};
  wide.run(10s);
  const double hit = wide.hit_percent();
  EXPECT_GT(hit, 35);
  EXPECT_LT(hit, 65);
}

TEST(publish_predictor, never_watches_for_more_than_8_ms_of_any_100_ms) {
  for (const std::vector<publisher>& all :
       {std::vector<publisher>{{.spread = 300us}}, //
        std::vector<publisher>{{.declared = 200us, .real = 200us, .spread = 30us}},
        std::vector<publisher>{{.spread = 100us}, {.spread = 100us, .due = begin + 300us}, {.real = 1010us}},
        std::vector<publisher>{
            {.declared = 10ms, .real = 10ms, .spread = 900us, .rank = priority::urgent}}}) {
    world w{all};
    w.run(5s);
    EXPECT_LE(w.watched_max(), 8ms);
    EXPECT_GT(w.watched_max(), 3ms); // which took some watching
  }
}

TEST(publish_predictor, leaves_the_budget_to_topics_of_more_priority) {
  world w{{{.spread = 100us, .rank = priority::bulk},
           {.spread = 100us, .rank = priority::urgent, .due = begin + 500us}}};
  w.run(10s);
  EXPECT_LT(median(w.publishers[1].waited), soon);
  const auto awake_for = [](const publisher& p) {
    return std::count_if(p.waited.begin(), p.waited.end(), [](duration one) { return one < soon; });
  };
  EXPECT_GT(awake_for(w.publishers[1]), 9700);
  EXPECT_LT(awake_for(w.publishers[0]), 8000);
}

TEST(publish_predictor, learns_how_long_a_loop_computes_before_it_publishes) {
  for (const duration computes : {50us, 200us, 600us}) {
    world w{{{.spread = 10us, .computes = computes}}};
    w.run(100ms);
    (void)w.hit_percent();
    w.run(10s);
    EXPECT_GT(w.hit_percent(), 99);
    EXPECT_LT(w.count(counter::phase_watched_ns), 300'000'000u);
  }
}

TEST(publish_predictor, follows_clocks_that_drift) {
  for (const std::int64_t real_ns : {1'000'100, 999'000, 1'020'000}) {
    world w{{{.real = duration{real_ns}, .spread = 10us}}};
    w.run(200ms);
    (void)w.hit_percent();
    w.run(10s);
    EXPECT_GT(w.hit_percent(), 99) << real_ns;
  }
}

TEST(publish_predictor, is_awake_for_two_publishers_that_beat) {
  world w{{{.spread = 10us}, {.real = 1001us, .spread = 10us}}};
  w.run(10s);
  EXPECT_GT(w.hit_percent(), 99);
  EXPECT_LT(w.watched_max(), 8ms);
}

TEST(publish_predictor, watches_three_times_in_vain_in_a_pause_and_learns_again_behind_it) {
  world w{{{.spread = 10us, .pause_at = begin + 3s, .pause_to = begin + 7s + 300us}}};
  w.run(3s);
  const std::uint64_t before = w.count(counter::phase_watched_ns);
  w.run(4s);
  EXPECT_LT(w.count(counter::phase_watched_ns) - before, 300'000u);
  w.run(100ms);
  (void)w.hit_percent();
  w.run(3s);
  EXPECT_GT(w.hit_percent(), 99);
}

TEST(publish_predictor, waits_no_longer_than_a_poll_for_a_value_that_is_late) {
  world w{{{.spread = 10us, .pause_at = begin + 500ms, .pause_to = begin + 500ms + 400us}}};
  w.run(1s);
  const auto& waited = w.publishers[0].waited;
  EXPECT_LT(*std::max_element(waited.begin(), waited.end()), poll_period + 50us);
}

TEST(publish_predictor, polls_where_the_declared_period_is_wrong) {
  for (const duration real : {500us, 2000us}) {
    world w{{{.real = real}}};
    w.run(10s);
    EXPECT_EQ(w.count(counter::phase_hits), 0u);
    EXPECT_TRUE(w.watched.empty());
    EXPECT_LT(median(w.publishers[0].waited), poll_period);
  }
}

TEST(publish_predictor, sleeps_past_polls_but_not_for_longer_than_10_ms) {
  world w{{{.declared = 100ms, .real = 100ms, .spread = 10us}}};
  w.run(2s);
  w.sleeps = 0;
  w.run(1s);
  EXPECT_GE(w.sleeps, 100u);
  EXPECT_LT(w.sleeps, 130u);
}

TEST(publish_predictor, forgets_a_topic_nobody_listens_to_and_a_publisher_that_is_gone) {
  world w{{{}, {}}};
  w.run(1s);
  w.plan.listen({0}, false);
  EXPECT_EQ(w.plan.listened(), 1u);
  w.plan.saw({0}, w.now);
  w.plan.end({0});
  w.plan.end({1});
  w.plan.end({1});
  EXPECT_EQ(w.plan.listened(), 0u);
  EXPECT_EQ(w.plan.wait_until(w.now, poll_period), rowe::rt::never);
  w.plan.begin({1}, 1ms, priority::normal);
  w.plan.listen({1}, true);
  EXPECT_EQ(w.plan.wait_until(w.now, poll_period), w.now + poll_period);
}

// A request, and its answer after so long; returns how long was watched for it.
duration ask(world& w, duration takes) {
  const std::uint64_t before = w.count(counter::phase_watched_ns);
  w.now += 5ms;
  (void)w.plan.wait_until(w.now, poll_period);
  w.plan.asked(w.now);
  const time_point answer = w.now + takes;
  while (w.now < answer && w.plan.wait_until(w.now, poll_period) <= w.now) w.now += turn;
  w.now = std::max(w.now, answer);
  w.plan.answered(answer);
  EXPECT_EQ(w.plan.wait_until(w.now, poll_period), rowe::rt::never);
  return duration{static_cast<std::int64_t>(w.count(counter::phase_watched_ns) - before)};
}

TEST(publish_predictor, watches_for_answers_unless_three_were_long_in_coming_and_until_eight_were_not) {
  world w{{}};
  for (int i = 0; i < 20; ++i) EXPECT_GE(ask(w, 40us), 40us);
  for (int i = 0; i < 2; ++i) EXPECT_GE(ask(w, 300us), publish_predictor::answer_max);
  EXPECT_GE(ask(w, 40us), 40us);
  for (int i = 0; i < 3; ++i) EXPECT_LT(ask(w, 300us), publish_predictor::answer_max + 2 * turn);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(ask(w, 300us), 0us);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(ask(w, 40us), 0us);
  EXPECT_GE(ask(w, 40us), 40us);
}

TEST(publish_predictor, watches_for_answers_within_its_budget) {
  world w{{}};
  const time_point end = w.now + 100ms;
  duration watched{};
  while (w.now < end) {
    w.plan.asked(w.now);
    const time_point answer = w.now + 90us;
    while (w.now < answer) {
      const bool awake = w.plan.wait_until(w.now, poll_period) <= w.now;
      w.now += turn;
      watched += awake ? turn : 0ns;
    }
    w.plan.answered(answer);
  }
  EXPECT_LE(watched, 8ms);
  EXPECT_GT(watched, 5ms);
}

TEST(publish_predictor, bears_stamps_that_are_no_times_of_its_clock) {
  for (const time_point stamp : {time_point::min(), time_point{}, time_point::max()}) {
    world w{{}};
    w.plan.begin({0}, 1ms, priority::normal);
    w.plan.listen({0}, true);
    for (int i = 0; i < 100; ++i) {
      w.plan.looks(w.now);
      w.plan.saw({0}, stamp);
      EXPECT_GE(w.plan.wait_until(w.now, poll_period), w.now);
      w.now += 300us;
    }
  }
}

} // namespace
} // namespace publish_predictor_test
