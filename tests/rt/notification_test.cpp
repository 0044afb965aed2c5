// SPDX-License-Identifier: Apache-2.0
// The notification's word protocol against a kernel that is scripted, then against the real one with two
// threads.
#include <rowe/rt/notification.hpp>

#include <atomic>
#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "rt/watchdog.hpp"

namespace notification_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::monotonic_clock;
using rowe::rt::never;
using rowe::rt::time_point;

// Does what the test tells it to when a thread would sleep.
struct scripted_kernel {
  using word = rowe::rt::std_atomics::variable<std::uint32_t>;
  static inline std::function<bool()> sleep; // answers whether the deadline has not come
  static inline int sleeps = 0;
  static inline int wakes = 0;
  static inline time_point deadline;

  static bool wait(word& w, std::uint32_t expected, time_point until) noexcept {
    ++sleeps;
    deadline = until;
    return w.load(std::memory_order_seq_cst) != expected || sleep();
  }
  static void wake(word&) noexcept { ++wakes; }
  static void reset() {
    sleep = [] { return false; };
    sleeps = wakes = 0;
  }
};

class notification_protocol : public ::testing::Test {
 protected:
  notification_protocol() { scripted_kernel::reset(); }

  rowe::rt::notification<rowe::rt::std_atomics, scripted_kernel> shared;
  bool there = false;
  bool wait() {
    return shared.wait_until(never, [this] { return there; });
  }
};

TEST_F(notification_protocol, does_not_sleep_for_what_is_there) {
  there = true;
  EXPECT_TRUE(wait());
  EXPECT_EQ(scripted_kernel::sleeps, 0);
}

TEST_F(notification_protocol, enters_no_kernel_when_nobody_sleeps) {
  shared.notify();
  shared.notify();
  EXPECT_EQ(scripted_kernel::wakes, 0);
}

TEST_F(notification_protocol, wakes_a_sleeper_once_for_several_notifications) {
  scripted_kernel::sleep = [this] {
    there = true;
    shared.notify();
    shared.notify();
    shared.notify();
    return true;
  };
  EXPECT_TRUE(wait());
  EXPECT_EQ(scripted_kernel::wakes, 1);
}

TEST_F(notification_protocol, looks_again_when_notified_between_look_and_sleep) {
  int looks = 0;
  EXPECT_TRUE(shared.wait_until(never, [&] {
    if (++looks == 1) shared.notify(); // comes too late for this look
    return looks == 2;
  }));
  EXPECT_EQ(scripted_kernel::sleeps, 0);
  EXPECT_EQ(scripted_kernel::wakes, 0);
}

TEST_F(notification_protocol, sleeps_again_when_woken_for_nothing) {
  scripted_kernel::sleep = [this] {
    there = scripted_kernel::sleeps == 3;
    return true;
  };
  EXPECT_TRUE(wait());
  EXPECT_EQ(scripted_kernel::sleeps, 3);
}

TEST_F(notification_protocol, gives_up_at_the_deadline) {
  const time_point deadline = monotonic_clock::now();
  EXPECT_FALSE(shared.wait_until(deadline, [] { return false; }));
  EXPECT_EQ(scripted_kernel::sleeps, 1);
  EXPECT_EQ(scripted_kernel::deadline, deadline);
}

TEST_F(notification_protocol, sees_what_came_at_the_last_moment) {
  scripted_kernel::sleep = [this] {
    there = true; // without a notification, as the deadline passes
    return false;
  };
  EXPECT_TRUE(wait());
}

TEST_F(notification_protocol, is_not_asleep_after_giving_up) {
  EXPECT_FALSE(wait());
  shared.notify();
  EXPECT_EQ(scripted_kernel::wakes, 0);
}

TEST(notification, returns_after_a_deadline_and_not_before) {
  const rowe::tests::watchdog dog{"waiting for a deadline"};
  rowe::rt::notification<> shared;
  for (const auto wait : {0ms, 1ms, 20ms}) {
    const time_point deadline = monotonic_clock::now() + wait;
    EXPECT_FALSE(shared.wait_until(deadline, [] { return false; }));
    EXPECT_GE(monotonic_clock::now(), deadline);
  }
}

TEST(notification, takes_a_deadline_before_the_clocks_origin_for_one_that_has_passed) {
  const rowe::tests::watchdog dog{"waiting for a deadline long ago"};
  rowe::rt::notification<> shared;
  EXPECT_FALSE(shared.wait_until(time_point::min(), [] { return false; }));
  EXPECT_FALSE(shared.wait_until(time_point{}, [] { return false; }));
}

TEST(notification, wakes_a_thread_that_sleeps_for_ever) {
  const rowe::tests::watchdog dog{"a sleeper that is notified"};
  rowe::rt::notification<> shared;
  std::atomic<bool> there{false};
  std::thread sleeper{[&] { EXPECT_TRUE(shared.wait_until(never, [&] { return there.load(); })); }};
  there = true;
  shared.notify();
  sleeper.join();
}

TEST(notification, loses_no_wake_up_between_two_threads) {
  const rowe::tests::watchdog dog{"two threads that wake each other"};
  constexpr int rounds = 20'000;
  rowe::rt::notification<> ping;
  rowe::rt::notification<> pong;
  // Relaxed, since the notification itself must order them: each exchange pairs with the other side's.
  std::atomic<int> pinged{0};
  std::atomic<int> ponged{0};
  std::thread partner{[&] {
    for (int round = 1; round <= rounds; ++round) {
      ASSERT_TRUE(ping.wait_until(never, [&] { return pinged.load(std::memory_order_relaxed) == round; }));
      ponged.store(round, std::memory_order_relaxed);
      pong.notify();
    }
  }};
  for (int round = 1; round <= rounds; ++round) {
    pinged.store(round, std::memory_order_relaxed);
    ping.notify();
    ASSERT_TRUE(pong.wait_until(never, [&] { return ponged.load(std::memory_order_relaxed) == round; }));
  }
  partner.join();
}

TEST(notification, takes_notifications_from_several_threads) {
  const rowe::tests::watchdog dog{"a sleeper with two notifiers"};
  constexpr int each = 20'000;
  rowe::rt::notification<> shared;
  std::atomic<int> sums[2]{};
  std::thread first{[&] {
    for (int i = 0; i < each; ++i) {
      sums[0].fetch_add(1);
      shared.notify();
    }
  }};
  std::thread second{[&] {
    for (int i = 0; i < each; ++i) {
      sums[1].fetch_add(1);
      shared.notify();
    }
  }};
  EXPECT_TRUE(shared.wait_until(never, [&] { return sums[0] + sums[1] == 2 * each; }));
  first.join();
  second.join();
}

} // namespace
} // namespace notification_test
