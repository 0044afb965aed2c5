// SPDX-License-Identifier: Apache-2.0
// The grid, overruns and ends of a periodic loop under a fake clock; signals and stop() under the kernel's.
#include <rowe/rt/periodic.hpp>

#include "fake_clock.hpp"
#include "watchdog.hpp"

#include <gtest/gtest.h>

#include <pthread.h>

#include <atomic>
#include <csignal>
#include <thread>

namespace periodic_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::basic_periodic;
using rowe::rt::duration;
using rowe::rt::never;
using rowe::rt::periodic;
using rowe::rt::time_point;
using rowe::tests::fake_clock;
using fake_periodic = basic_periodic<fake_clock>;

TEST(periodic, begins_its_grid_with_the_first_wait_which_returns_at_once) {
  fake_periodic loop{1ms};
  EXPECT_EQ(loop.next_deadline(), never);
  loop.clock().advance(10s); // set-up
  const time_point start = loop.clock().now();
  EXPECT_EQ(loop.wait(), start);
  EXPECT_EQ(loop.next_deadline(), start + 1ms);
  EXPECT_EQ(loop.overruns(), 0u);
  EXPECT_EQ(loop.lateness().count(), 0u);
}

TEST(periodic, keeps_to_the_grid_however_long_the_cycles_are) {
  fake_periodic loop{1ms};
  const time_point start = *loop.wait();
  for (int cycle = 1; cycle <= 1000; ++cycle) {
    loop.clock().advance(duration{cycle * 997 % 999'000});
    ASSERT_EQ(loop.wait(), start + cycle * 1ms);
  }
  EXPECT_EQ(loop.overruns(), 0u);
  EXPECT_EQ(loop.cycles(), 1001u);
}

TEST(periodic, skips_and_counts_whole_periods_and_returns_to_the_grid) {
  fake_periodic loop{1ms};
  const time_point start = *loop.wait();
  loop.clock().advance(3ms + 400us); // the deadlines at 1 and 2 ms are lost, the one at 3 ms is served late
  EXPECT_EQ(loop.wait(), start + 3ms + 400us);
  EXPECT_EQ(loop.overruns(), 2u);
  EXPECT_EQ(loop.next_deadline(), start + 4ms);
  EXPECT_EQ(loop.wait(), start + 4ms);
  EXPECT_EQ(loop.overruns(), 2u);
}

TEST(periodic, counts_no_overrun_for_a_cycle_that_is_late_by_less_than_a_period) {
  fake_periodic loop{1ms};
  const time_point start = *loop.wait();
  loop.clock().advance(2ms - 1ns);
  EXPECT_EQ(loop.wait(), start + 2ms - 1ns);
  EXPECT_EQ(loop.overruns(), 0u);
  EXPECT_EQ(loop.next_deadline(), start + 2ms);
}

TEST(periodic, survives_a_pause_of_an_hour_without_running_a_million_cycles) {
  fake_periodic loop{1ms};
  const time_point start = *loop.wait();
  loop.clock().advance(1h);
  EXPECT_EQ(loop.wait(), start + 1h);
  EXPECT_EQ(loop.overruns(), 3'599'999u);
  EXPECT_EQ(loop.wait(), start + 1h + 1ms);
}

TEST(periodic, records_how_late_its_cycles_begin) {
  fake_periodic loop{1ms};
  (void)loop.wait();
  (void)loop.wait(); // on time
  loop.clock().advance(1ms + 30us);
  (void)loop.wait();
  EXPECT_EQ(loop.lateness().count(), 2u);
  EXPECT_EQ(loop.lateness().min(), 0ns);
  EXPECT_EQ(loop.lateness().max(), 30us);
}

TEST(periodic, ends_after_cycles_max) {
  fake_periodic loop{1ms, {.cycles_max = 3}};
  int cycles = 0;
  while (loop.wait()) ++cycles;
  EXPECT_EQ(cycles, 3);
  EXPECT_FALSE(loop.wait());
}

TEST(periodic, ends_when_stopped_and_stays_so) {
  fake_periodic loop{1ms};
  ASSERT_TRUE(loop.wait());
  loop.stop();
  const time_point before = loop.clock().now();
  EXPECT_FALSE(loop.wait());
  EXPECT_FALSE(loop.wait());
  EXPECT_EQ(loop.clock().now(), before) << "a stopped loop does not wait once more";
  EXPECT_TRUE(loop.stopped());
}

TEST(periodic, stopped_before_the_first_wait_runs_no_cycle) {
  fake_periodic loop{1ms};
  loop.stop();
  EXPECT_FALSE(loop.wait());
  EXPECT_EQ(loop.cycles(), 0u);
}

// A clock whose waits are cut short, as by signals, and which counts how often it is read.
struct interrupted_clock {
  fake_clock clock = {};
  int interruptions = 0;
  int reads = 0;
  time_point now() {
    ++reads;
    return clock.now();
  }
  void sleep_until(time_point deadline) {
    if (interruptions > 0) {
      --interruptions;
      clock.advance((deadline - clock.now()) / 2);
    } else {
      clock.sleep_until(deadline);
    }
  }
};

TEST(periodic, goes_on_waiting_when_a_signal_interrupts_it) {
  basic_periodic<interrupted_clock> loop{1ms};
  const time_point start = *loop.wait();
  loop.clock().interruptions = 5;
  EXPECT_EQ(loop.wait(), start + 1ms);
  EXPECT_EQ(loop.clock().interruptions, 0);
}

TEST(periodic, reads_the_clock_once_a_cycle) {
  basic_periodic<interrupted_clock> loop{1ms};
  for (int cycle = 1; cycle <= 10; ++cycle) {
    (void)loop.wait();
    EXPECT_EQ(loop.clock().reads, cycle);
  }
}

TEST(periodic, never_returns_before_its_deadline_under_the_kernels_clock) {
  periodic loop{200us, {.cycles_max = 100}};
  time_point deadline = loop.next_deadline();
  while (const auto now = loop.wait()) {
    EXPECT_TRUE(deadline == never || *now >= deadline);
    deadline = loop.next_deadline();
  }
  EXPECT_EQ(loop.cycles(), 100u);
  EXPECT_EQ(loop.lateness().count(), 99u);
}

TEST(periodic, reports_what_it_was_granted) {
  char buffer[300];
  const periodic loop{1ms, {.cpu = 1 << 20}};
  EXPECT_TRUE(loop.grants().pinned.refused());
  EXPECT_NE(loop.grants().text(buffer).find("cpu 1048576 does not exist"), std::string_view::npos);
}

TEST(periodic, is_stopped_from_another_thread_within_a_period) {
  const rowe::tests::watchdog guard{"a loop that another thread stops"};
  periodic loop{100us};
  std::thread stopper{[&] {
    while (loop.cycles() < 10) std::this_thread::yield();
    loop.stop();
  }};
  while (loop.wait()) {
  }
  stopper.join();
  EXPECT_GE(loop.cycles(), 10u);
}

// ThreadSanitizer puts a signal's handler off until the next call that it knows, and clock_nanosleep is none:
// the wait is interrupted, but what interrupted it has not run. So these two are left to the other builds.
#if defined(__has_feature)
#define ROWE_UNDER_TSAN __has_feature(thread_sanitizer)
#elif defined(__SANITIZE_THREAD__)
#define ROWE_UNDER_TSAN 1
#else
#define ROWE_UNDER_TSAN 0
#endif
#if !ROWE_UNDER_TSAN

std::atomic<periodic*> loop_to_stop{nullptr};
std::atomic<int> signals_seen{0};

// Sends SIGUSR1 to the calling thread from another one until `done`; a signal may fall before the wait
// begins.
class signal_rain {
 public:
  explicit signal_rain(void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    ::sigaction(SIGUSR1, &action, &before_);
    thread_ = std::thread{[this, target = ::pthread_self()] {
      while (!done_) {
        ::pthread_kill(target, SIGUSR1);
        std::this_thread::yield();
      }
    }};
  }
  ~signal_rain() {
    done_ = true;
    thread_.join();
    ::sigaction(SIGUSR1, &before_, nullptr);
  }

 private:
  struct sigaction before_ {};
  std::atomic<bool> done_{false};
  std::thread thread_;
};

TEST(periodic, is_stopped_by_a_signal_in_the_middle_of_a_long_wait) {
  const rowe::tests::watchdog guard{"a loop that a signal handler stops"};
  periodic loop{1h};
  ASSERT_TRUE(loop.wait());
  loop_to_stop = &loop;
  const signal_rain rain{[](int) { loop_to_stop.load()->stop(); }};
  EXPECT_FALSE(loop.wait());
}

TEST(periodic, waits_for_its_deadline_through_a_rain_of_signals) {
  const rowe::tests::watchdog guard{"a loop under signals"};
  periodic loop{2ms};
  signals_seen = 0;
  {
    const signal_rain rain{[](int) { ++signals_seen; }};
    time_point deadline = never;
    while (const auto now = loop.wait()) {
      ASSERT_TRUE(deadline == never || *now >= deadline);
      deadline = loop.next_deadline();
      if (loop.cycles() >= 20 && signals_seen > 0) loop.stop(); // the rain begins when its thread is run
    }
  }
}
#endif // ROWE_UNDER_TSAN

} // namespace
} // namespace periodic_test
