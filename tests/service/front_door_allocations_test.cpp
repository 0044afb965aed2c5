// SPDX-License-Identifier: Apache-2.0
// The front door never allocates after set-up, however many threads come and go, and on the side of the
// service thread touches no lock and does not wait; it enters the kernel only to wake. Each thread looks at
// itself, by the tripwire.
#include "service/front_door.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/rt/tripwire.hpp>

#include "rt/watchdog.hpp"

namespace {

using namespace rowe;
using service::front_door;

constexpr int generations = 10;
constexpr int threads_each = 20;
constexpr int rounds = 50; // of each thread

struct house {
  rt::arena memory{rt::arena::bytes_for<front_door>() + front_door::footprint_bytes(limits{}),
                   rt::page_lock::none};
  front_door& door{*memory.make<front_door>(memory, limits{})};
};

// Everything a thread outside can do. Returns what it allocated.
std::uint64_t use(front_door& door) {
  const std::string text(100, 'x');
  auto wire = rt::tripwire::arm();
  for (int round = 0; round != rounds; ++round) {
    (void)door.submit({}, text);
    const auto asked = door.submit({.wants_outcome = true}, text);
    if (asked && door.wait(*asked, round % 2 == 0 ? rt::never : rt::time_point{})) {
      (void)door.reply_text(*asked);
      door.give_back(*asked);
    }
    const rt::time_point now = rt::monotonic_clock::now();
    const auto arrived =
        round % 3 == 0 ? door.receive(now + std::chrono::microseconds{50}) : door.try_receive(now);
    if (arrived) door.give_back_inbound(*arrived);
  }
  return wire.disarm().allocations;
}

TEST(front_door_allocations, are_none_for_200_threads_that_come_and_go) {
  const tests::watchdog dog{"threads at the front door"};
  house h;
  std::atomic<bool> over{false};
  std::atomic<std::uint64_t> allocations{0};
  rt::tripwire::report served;
  std::thread service{[&] {
    const std::string reply(50, 'y');
    auto wire = rt::tripwire::arm();
    while (!over) {
      h.door.take([&](std::uint32_t slot) { h.door.settle(slot, {}, reply); }, SIZE_MAX);
      (void)h.door.deliver({}, reply);
    }
    served = wire.disarm();
  }};
  for (int generation = 0; generation != generations; ++generation) {
    std::vector<std::thread> users;
    for (int i = 0; i != threads_each; ++i) users.emplace_back([&] { allocations += use(h.door); });
    for (std::thread& user : users) user.join();
  }
  over = true;
  service.join();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(served.allocations, 0U);
  EXPECT_EQ(served.locks, 0U);
  h.door.finish();
  while (const auto left = h.door.try_receive(rt::time_point{})) h.door.give_back_inbound(*left);
  EXPECT_STREQ(h.door.check(), nullptr);
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door_allocations, are_none_at_set_up_either) {
  rt::arena memory{rt::arena::bytes_for<front_door>() + front_door::footprint_bytes(limits{}),
                   rt::page_lock::none};
  auto wire = rt::tripwire::arm();
  const bool made = memory.make<front_door>(memory, limits{}) != nullptr;
  const auto seen = wire.disarm();
  EXPECT_TRUE(made);
  EXPECT_EQ(seen.allocations, 0U);
}

// Both sides in one thread, so that nobody sleeps: no system call, no page fault, no wait, nothing.
TEST(front_door_allocations, are_not_all_that_is_missing_while_nobody_sleeps) {
  house h;
  constexpr int requests = 1000;
  int settled = 0;
  int arrived = 0;
  std::string findings = "skipped";
  std::thread{[&] {
    if (!rt::tripwire::watch_system_calls()) return;
    const std::string text(100, 'x');
    for (int run = 0; run != 2; ++run) { // the first pages in what the thread itself needs
      settled = arrived = 0;
      auto wire = rt::tripwire::arm();
      for (int i = 0; i != requests; ++i) {
        const bool waits = i % 2 == 0;
        const auto asked = h.door.submit({.wants_outcome = waits}, text);
        h.door.take([&](std::uint32_t slot) { h.door.settle(slot, {}, text); }, SIZE_MAX);
        if (waits ? h.door.wait(*asked, rt::never) : h.door.drained()) ++settled;
        if (waits) h.door.give_back(*asked);
        (void)h.door.deliver({}, text);
        if (const auto slot = h.door.receive(rt::never)) {
          ++arrived;
          h.door.give_back_inbound(*slot);
        }
      }
      const auto seen = wire.disarm();
      std::array<char, 200> buffer;
      findings = seen.clean() ? "" : std::string{seen.text(buffer)};
    }
  }}.join();
  if (findings == "skipped") GTEST_SKIP() << "the kernel does not let system calls be watched";
  EXPECT_EQ(settled, requests);
  EXPECT_EQ(arrived, requests);
  EXPECT_EQ(findings, "");
}

} // namespace
