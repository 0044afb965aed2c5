// SPDX-License-Identifier: Apache-2.0
// The schedule, what a stall is charged to, and what is kept of it, on a clock that moves only when told to.
#include "rt/fake_clock.hpp"
#include "tools/bench/pump.hpp"

#include <deque>
#include <string>

#include <gtest/gtest.h>

namespace rowe::tools::bench {
namespace bench_pump_test {
namespace {

using namespace std::chrono_literals;
using rt::time_point;

constexpr time_point start{10s};
const std::atomic<bool> never_stop{false};

TEST(bench_schedule, lies_on_a_grid) {
  constexpr schedule s{start, 1ms, 5};
  EXPECT_EQ(s.time_of(0), start);
  EXPECT_EQ(s.time_of(4), start + 4ms);
  EXPECT_EQ(s.time_of(5), rt::never);
  EXPECT_EQ(s.due_by(start - 1ns), 0U);
  EXPECT_EQ(s.due_by(start), 1U);
  EXPECT_EQ(s.due_by(start + 1ms - 1ns), 1U);
  EXPECT_EQ(s.due_by(start + 1ms), 2U);
  EXPECT_EQ(s.due_by(start + 1h), 5U);
}

TEST(bench_schedule, can_be_cut_and_not_lengthened) {
  schedule s{start, 1ms, 5};
  s.cut(9);
  EXPECT_EQ(s.count(), 5U);
  s.cut(2);
  EXPECT_EQ(s.count(), 2U);
  EXPECT_EQ(s.time_of(2), rt::never);
}

TEST(bench_schedule, counts_the_periods_in_a_time) {
  EXPECT_EQ(period_of(1000), 1ms);
  EXPECT_EQ(period_of(3), 333'333'333ns);
  EXPECT_EQ(count_in(1s, 1ms), 1000U);
  EXPECT_EQ(count_in(1us, 1ms), 1U);
}

TEST(bench_recording, keeps_what_is_above_the_bound_in_its_order_and_the_worst_by_size) {
  recording r{100us};
  r.begin(start);
  for (int i = 1; i <= 20; ++i) r.record(start + i * 1ms, start + i * 1ms + (i * 37 % 20) * 10us);
  ASSERT_EQ(r.over_count(), 9U); // 110 to 190 us
  EXPECT_EQ(r.over().front().at, 1ms);
  EXPECT_EQ(r.over().front().value, 170us);
  ASSERT_EQ(r.worst().size(), recording::worst_kept_max);
  for (std::size_t i = 0; i < r.worst().size(); ++i) EXPECT_EQ(r.worst()[i].value, (19 - i) * 10us) << i;
}

TEST(bench_recording, counts_what_it_has_no_room_for) {
  recording r{1ns};
  for (std::uint64_t i = 0; i < recording::over_kept_max + 5; ++i) r.record(start, start + 1ms);
  EXPECT_EQ(r.over_count(), recording::over_kept_max + 5);
  EXPECT_EQ(r.over().size(), recording::over_kept_max);
}

TEST(bench_recording, halves_a_round_trip_where_it_is_told_to) {
  recording r{100us, 2};
  r.record(start, start + 150us);
  EXPECT_EQ(r.times().max(), 75us);
  EXPECT_EQ(r.over_count(), 0U);
}

// Answers in order, each `latency` after it was sent, but nothing between `stalled` and `resumed`; has room
// for `room` at once, and loses what `loses` names.
struct fake_peer {
  tests::fake_clock& clock;
  rt::duration latency = 50us;
  time_point stalled = rt::never, resumed = rt::never;
  std::size_t buffer = 1000;
  std::uint64_t loses = ~std::uint64_t{0};
  ending how = ending::well;
  bool gone = false;
  std::deque<arrival> on_the_way = {};

  bool send(std::uint64_t number, time_point now) {
    if (on_the_way.size() == buffer) return false;
    time_point at = now + latency;
    if (at >= stalled && at < resumed) at = resumed;
    if (number != loses) on_the_way.push_back({number, at, how});
    return true;
  }
  template <class Sink>
  void take(Sink&& sink) {
    for (; !on_the_way.empty() && on_the_way.front().at <= clock.now(); on_the_way.pop_front())
      sink(on_the_way.front());
  }
  void wait(time_point until) {
    clock.sleep_until(on_the_way.empty() ? until : std::min(until, on_the_way.front().at));
  }
  bool over() const { return gone; }
};

struct bench_pump : testing::Test {
  tests::fake_clock clock;
  fake_peer peer{clock};
  recording samples{1ms};

  pump_counts run(std::uint64_t count, std::uint64_t first = 0, const std::atomic<bool>& stop = never_stop) {
    clock.set(start - 1ms);
    samples.begin(start);
    marks ended(count);
    return pump({start, 1ms, count}, first, peer, samples, ended, 1s, stop, clock);
  }
};

TEST_F(bench_pump, measures_each_message_from_its_intended_time) {
  const pump_counts c = run(100);
  EXPECT_EQ(c.intended, 100U);
  EXPECT_EQ(c.finished, 100U);
  EXPECT_EQ(c.failed + c.unfinished, 0U);
  EXPECT_EQ(samples.times().count(), 100U);
  EXPECT_EQ(samples.times().min(), 50us);
  EXPECT_EQ(samples.times().max(), 50us);
}

TEST_F(bench_pump, charges_a_stall_to_every_message_that_it_delayed) {
  peer.stalled = start + 20ms;
  peer.resumed = start + 30ms;
  const pump_counts c = run(100);
  EXPECT_EQ(c.finished, 100U);
  EXPECT_EQ(samples.times().max(), 10ms); // the one that was due as it began
  EXPECT_EQ(samples.over_count(), 9U);    // 10, 9, ... 2 ms; the one of 1 ms is not above it
}

TEST_F(bench_pump, charges_a_stall_also_where_only_one_message_can_be_on_its_way) {
  peer.stalled = start + 20ms;
  peer.resumed = start + 30ms;
  peer.buffer = 1;
  const pump_counts c = run(100);
  EXPECT_EQ(c.finished, 100U);
  EXPECT_EQ(samples.times().max(), 10ms);
  EXPECT_GE(samples.over_count(), 9U); // those that were sent late are late
}

TEST_F(bench_pump, charges_what_holds_the_measuring_thread_up) {
  struct held_up : fake_peer {
    bool send(std::uint64_t number, time_point now) {
      if (number == 10) clock.advance(5ms); // somebody else had the CPU
      return fake_peer::send(number, now);
    }
  } slow{{clock}};
  clock.set(start);
  marks ended(20);
  const pump_counts c = pump({start, 1ms, 20}, 0, slow, samples, ended, 1s, never_stop, clock);
  EXPECT_EQ(c.finished, 20U);
  EXPECT_GE(samples.times().max(), 4ms);
  EXPECT_GE(samples.over_count(), 4U); // 11 to 14 were due meanwhile
}

TEST_F(bench_pump, records_what_never_comes_back_with_the_time_it_was_waited_for) {
  peer.loses = 7;
  const pump_counts c = run(10);
  EXPECT_EQ(c.finished, 9U);
  EXPECT_EQ(c.unfinished, 1U);
  EXPECT_EQ(samples.times().count(), 10U);
  EXPECT_GE(samples.times().max(), 1s);
}

TEST_F(bench_pump, counts_what_was_never_sent) {
  peer.buffer = 0;
  const pump_counts c = run(10);
  EXPECT_EQ(c.intended, 10U);
  EXPECT_EQ(c.unfinished, 10U);
  EXPECT_EQ(samples.times().count(), 10U);
  EXPECT_GE(samples.times().min(), 1s);
}

TEST_F(bench_pump, counts_failures_with_the_time_they_took) {
  peer.how = ending::failed;
  EXPECT_EQ(run(10).failed, 10U);
  EXPECT_EQ(samples.times().count(), 10U);
  peer.how = ending::timed_out;
  EXPECT_EQ(run(10).unfinished, 10U);
}

TEST_F(bench_pump, ends_when_nothing_can_come_any_more) {
  peer.gone = true;
  const pump_counts c = run(1000);
  EXPECT_LE(c.intended, 1U);
  EXPECT_EQ(c.finished, 0U);
}

TEST_F(bench_pump, ends_early_when_told_to_and_keeps_what_it_has) {
  std::atomic<bool> stop{false};
  struct stopping : fake_peer {
    std::atomic<bool>* stop;
    bool send(std::uint64_t number, time_point now) {
      if (number == 5) *stop = true;
      return fake_peer::send(number, now);
    }
  } target{{clock}, &stop};
  clock.set(start);
  marks ended(1000);
  const pump_counts c = pump({start, 1ms, 1000}, 0, target, samples, ended, 1s, stop, clock);
  EXPECT_EQ(c.intended, 6U);
  EXPECT_EQ(c.finished, 6U);
}

TEST_F(bench_pump, takes_no_late_message_of_an_earlier_run_for_its_own) {
  peer.on_the_way.push_back({3, start, ending::well});
  const pump_counts c = run(10, 100);
  EXPECT_EQ(c.finished, 10U);
  EXPECT_EQ(samples.times().count(), 10U);
  EXPECT_EQ(samples.times().max(), 50us);
}

} // namespace
} // namespace bench_pump_test
} // namespace rowe::tools::bench
