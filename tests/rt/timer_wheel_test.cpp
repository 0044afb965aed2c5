// SPDX-License-Identifier: Apache-2.0
// The wheel alone, and against an oracle: a sorted map of the same entries, over random scripts of inserting,
// moving, cancelling and letting time pass, with the invariants checked after every step.
#include <rowe/rt/timer_wheel.hpp>

#include "seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace timer_wheel_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::never;
using rowe::rt::time_point;
using rowe::rt::timer_node;
using rowe::rt::timer_wheel;

constexpr time_point start{1000s};
constexpr duration tick = timer_wheel::tick;

struct wheel_of_eight {
  std::vector<timer_node> nodes = std::vector<timer_node>(8);
  timer_wheel wheel{nodes, start};
};

// Pulls everything that is due and returns it.
template <class Wheel>
std::vector<std::uint32_t> expired(Wheel& wheel, time_point now) {
  std::vector<std::uint32_t> due;
  for (std::uint32_t node; (node = wheel.expire(now)) != Wheel::none;) due.push_back(node);
  return due;
}

TEST(timer_wheel, is_empty_at_first) {
  wheel_of_eight w;
  EXPECT_TRUE(w.wheel.empty());
  EXPECT_EQ(w.wheel.next_wake(), never);
  EXPECT_EQ(w.wheel.expire(start + 24h), timer_wheel::none);
  EXPECT_EQ(w.wheel.check(), nullptr);
}

TEST(timer_wheel, reports_an_entry_within_one_tick_after_its_expiry_and_never_before) {
  for (const duration ttl : {1ns, 999ns, 65'535ns, 65'536ns, 65'537ns, 1'000'000ns, 123'456'789ns,
                             duration{10s}, duration{1h}, duration{24h * 365}}) {
    wheel_of_eight w;
    w.wheel.insert(3, start + ttl);
    EXPECT_EQ(w.wheel.expire(start + ttl - 1ns), timer_wheel::none) << ttl.count();
    EXPECT_EQ(w.wheel.check(), nullptr);
    EXPECT_EQ(w.wheel.expire(start + ttl + tick - 1ns), 3u) << ttl.count();
    EXPECT_FALSE(w.wheel.contains(3));
    EXPECT_EQ(w.wheel.check(), nullptr);
  }
}

TEST(timer_wheel, reports_an_expiry_in_the_past_at_once) {
  wheel_of_eight w;
  w.wheel.insert(0, start - 1s);
  w.wheel.insert(1, time_point{});
  w.wheel.insert(2, time_point{-5s});
  w.wheel.insert(3, start - tick);
  EXPECT_LE(w.wheel.next_wake(), start);
  EXPECT_EQ(expired(w.wheel, start), (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST(timer_wheel, takes_never_as_not_inserted) {
  wheel_of_eight w;
  w.wheel.insert(5, never);
  EXPECT_FALSE(w.wheel.contains(5));
  w.wheel.insert(5, start + 1s);
  EXPECT_EQ(w.wheel.expiry_of(5), start + 1s);
  w.wheel.insert(5, never);
  EXPECT_FALSE(w.wheel.contains(5));
  EXPECT_TRUE(w.wheel.empty());
  EXPECT_EQ(w.wheel.next_wake(), never);
}

TEST(timer_wheel, changes_nothing_when_entries_are_prefetched) {
  wheel_of_eight w;
  for (std::uint32_t node = 0; node < 4; ++node) w.wheel.insert(node, start + 1ms);
  w.wheel.cancel(1);
  for (std::uint32_t node = 0; node < 8; ++node) { // some are on the wheel, one was, some never
    w.wheel.prefetch(node);
    w.wheel.prefetch_neighbours(node);
  }
  EXPECT_EQ(w.wheel.check(), nullptr);
  EXPECT_EQ(expired(w.wheel, start + 2ms), (std::vector<std::uint32_t>{0, 2, 3}));
}

TEST(timer_wheel, lets_an_entry_be_cancelled_between_two_pulls_of_the_same_tick) {
  wheel_of_eight w;
  for (std::uint32_t node = 0; node < 4; ++node) w.wheel.insert(node, start + 1ms);
  EXPECT_EQ(w.wheel.expire(start + 2ms), 0u);
  w.wheel.cancel(2);
  EXPECT_EQ(w.wheel.check(), nullptr);
  EXPECT_EQ(expired(w.wheel, start + 2ms), (std::vector<std::uint32_t>{1, 3}));
}

TEST(timer_wheel, names_the_next_wake_exactly_within_sixty_four_ticks) {
  wheel_of_eight w;
  (void)w.wheel.expire(start);
  const time_point floor{duration{start.time_since_epoch().count() / tick.count() * tick.count()}};
  w.wheel.insert(0, floor + 3 * tick + 1ns);
  EXPECT_EQ(w.wheel.next_wake(), floor + 4 * tick);
}

TEST(timer_wheel, reaches_a_far_entry_by_sleeping_on_next_wake_a_few_times) {
  wheel_of_eight w;
  const time_point expiry = start + 24h * 365 * 100 + 12'345'678ns;
  w.wheel.insert(0, expiry);
  int wakes = 0;
  for (time_point now = start; w.wheel.contains(0);) {
    ASSERT_GT(w.wheel.next_wake(), now);
    now = w.wheel.next_wake();
    ++wakes;
    const bool reported = w.wheel.expire(now) == 0;
    EXPECT_EQ(reported, now >= expiry);
    ASSERT_LE(wakes, 8);
  }
  EXPECT_EQ(w.wheel.check(), nullptr);
}

template <unsigned Bits>
void expect_to_hold_the_farthest_times() {
  SCOPED_TRACE(testing::Message() << "tick bits " << Bits);
  using wheel_type = rowe::rt::basic_timer_wheel<Bits>;
  std::vector<timer_node> nodes(2);
  wheel_type wheel{nodes, start};
  wheel.insert(0, never - 1ns);
  wheel.insert(1, never - wheel_type::tick);
  EXPECT_EQ(wheel.check(), nullptr);
  EXPECT_EQ(wheel.expire(never - 2 * wheel_type::tick), wheel_type::none);
  EXPECT_LT(wheel.next_wake(), never);
  EXPECT_EQ(wheel.expire(wheel.next_wake()), 1u);
  EXPECT_EQ(wheel.check(), nullptr);
  wheel.cancel(0);
  EXPECT_TRUE(wheel.empty());
}

TEST(timer_wheel, holds_times_as_far_away_as_there_are) {
  expect_to_hold_the_farthest_times<3>();
  expect_to_hold_the_farthest_times<15>();
  expect_to_hold_the_farthest_times<16>();
  expect_to_hold_the_farthest_times<32>();
}

TEST(timer_wheel, does_not_go_back_when_time_does) {
  wheel_of_eight w;
  (void)w.wheel.expire(start + 10s);
  w.wheel.insert(0, start + 5s);
  w.wheel.insert(1, start + 11s);
  EXPECT_EQ(expired(w.wheel, start), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(w.wheel.check(), nullptr);
  EXPECT_EQ(expired(w.wheel, start + 12s), (std::vector<std::uint32_t>{1}));
}

// The wheel beside its oracle, a sorted map. `Bits` makes ticks short or long; distances come from every
// level.
template <unsigned Bits>
class script {
 public:
  explicit script(std::uint64_t seed) : random_{seed} {}

  void run(int steps) {
    for (int step = 0; step < steps && !testing::Test::HasFatalFailure(); ++step) {
      const auto node = static_cast<std::uint32_t>(below(entries));
      const auto what = below(8);
      if (what < 4)
        insert(node);
      else if (what == 4)
        cancel(node);
      else
        pass_time();
      ASSERT_EQ(wheel_.check(), nullptr);
      ASSERT_EQ(wheel_.size(), oracle_.size());
      check_next_wake();
    }
    for (const auto& [expiry, node] : oracle_) ASSERT_EQ(wheel_.expiry_of(node), expiry);
  }

 private:
  using wheel_type = rowe::rt::basic_timer_wheel<Bits>;
  static constexpr std::uint32_t entries = 61;
  static constexpr duration tick = wheel_type::tick;

  std::uint64_t below(std::uint64_t end) { return random_() % end; }
  duration distance() { return duration{static_cast<std::int64_t>(random_() >> (1 + below(63)))}; }
  void forget(std::uint32_t node) {
    std::erase_if(oracle_, [&](const auto& entry) { return entry.second == node; });
  }

  void insert(std::uint32_t node) {
    const bool past = below(8) == 0;
    const duration away = distance();
    const time_point expiry = past ? now_ - std::min(away, duration{1s}) : deadline_after(now_, away);
    wheel_.insert(node, expiry);
    forget(node);
    if (expiry != never) oracle_.emplace(expiry, node);
    if (expiry <= now_) ordered_ = false;
  }

  void cancel(std::uint32_t node) {
    wheel_.cancel(node);
    forget(node);
  }

  // Mostly by small steps; sometimes exactly to the next wake-up, or to one nanosecond before it.
  void pass_time() {
    const time_point wake = wheel_.next_wake();
    time_point next = deadline_after(now_, distance() / 1024);
    const auto kind = below(4);
    if (kind < 2 && wake != never) next = std::max(now_, wake - duration{kind});
    const time_point far_enough{duration{std::int64_t{1} << 61}};
    if (next < far_enough) now_ = next;
    const bool too_soon = now_ < wake;
    const auto pulls = below(4) == 0 ? 1 + below(3) : std::uint64_t{entries} + 1;
    for (std::uint64_t pull = 0; pull < pulls && !testing::Test::HasFatalFailure(); ++pull) {
      const std::uint32_t due = wheel_.expire(now_);
      ASSERT_EQ(wheel_.check(), nullptr);
      if (due == wheel_type::none) {
        ASSERT_TRUE(oracle_.empty() || oracle_.begin()->first + tick > now_) << "left over a tick late";
        ordered_ = true;
        return;
      }
      ASSERT_FALSE(too_soon) << "due before next_wake()";
      take(due);
    }
  }

  void take(std::uint32_t due) {
    const auto is_due = [&](const auto& entry) { return entry.second == due; };
    const auto found = std::find_if(oracle_.begin(), oracle_.end(), is_due);
    ASSERT_NE(found, oracle_.end()) << "reported an entry that is not on the wheel";
    ASSERT_LE(found->first, now_) << "reported early";
    ASSERT_TRUE(!ordered_ || found->first - oracle_.begin()->first < tick) << "out of the order of ticks";
    oracle_.erase(found);
  }

  void check_next_wake() {
    const time_point wake = wheel_.next_wake();
    if (oracle_.empty()) {
      ASSERT_EQ(wake, never);
    } else {
      const time_point truth = std::max(oracle_.begin()->first, now_);
      ASSERT_TRUE(truth >= never - tick || wake < truth + tick) << "next_wake() later than the truth";
    }
  }

  std::mt19937_64 random_;
  std::vector<timer_node> nodes_ = std::vector<timer_node>(entries);
  time_point now_{duration{static_cast<std::int64_t>(below(std::uint64_t{1} << 40))}};
  wheel_type wheel_{nodes_, now_};
  std::multimap<time_point, std::uint32_t> oracle_;
  bool ordered_ = true; // nothing was inserted after its time since everything due was last pulled
};

template <unsigned Bits>
void run_script(std::uint64_t seed, int steps) {
  SCOPED_TRACE(testing::Message() << "tick bits " << Bits);
  script<Bits>{seed}.run(steps);
}

TEST(timer_wheel, agrees_with_a_sorted_map_over_random_scripts) {
  const std::uint64_t first = rowe::tests::test_seed{};
  for (std::uint64_t seed = first; seed < first + 30 && !HasFatalFailure(); ++seed) {
    const rowe::tests::test_seed named{seed};
    run_script<16>(seed, 4000);
    run_script<3>(seed, 4000);
    run_script<15>(seed, 2000);
    run_script<32>(seed, 2000);
  }
}

} // namespace
} // namespace timer_wheel_test
