// SPDX-License-Identifier: Apache-2.0
// The submission queue and the shared inbox never allocate after set-up, however many threads come and go,
// and on the side of the service thread touch no lock and do not wait; they enter the kernel only to wake.
// Each thread looks at itself, by the tripwire.
#include "service/threads/shared_inbox.hpp"
#include "service/threads/submission_queue.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/rt/tripwire.hpp>

#include "rt/watchdog.hpp"

namespace {

using namespace rowe;
using service::shared_inbox;
using service::submission_queue;

constexpr int generations = 10;
constexpr int threads_each = 20;
constexpr int rounds = 50; // of each thread

struct fixture {
  rt::arena memory{rt::arena::bytes_for<submission_queue>() + submission_queue::footprint_bytes(limits{}) +
                       rt::arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(limits{}),
                   rt::page_lock::none};
  submission_queue& submissions{*memory.make<submission_queue>(memory, limits{})};
  shared_inbox& inbox{*memory.make<shared_inbox>(memory, limits{})};
};

// Everything a thread outside can do. Returns what it allocated.
std::uint64_t use(fixture& h) {
  const std::string text(100, 'x');
  auto wire = rt::tripwire::arm();
  for (int round = 0; round != rounds; ++round) {
    (void)h.submissions.submit({}, text);
    const auto asked = h.submissions.submit({.wants_outcome = true}, text);
    if (asked && h.submissions.wait(*asked, round % 2 == 0 ? rt::never : rt::time_point{})) {
      (void)h.submissions.reply_text(*asked);
      h.submissions.release(*asked);
    }
    const rt::time_point now = rt::monotonic_clock::now();
    const auto arrived =
        round % 3 == 0 ? h.inbox.receive(now + std::chrono::microseconds{50}) : h.inbox.try_receive(now);
    if (arrived) h.inbox.release(*arrived);
  }
  return wire.disarm().allocations;
}

TEST(submissions_allocations, are_none_for_200_threads_that_come_and_go) {
  const tests::watchdog dog{"threads that submit and receive"};
  fixture h;
  std::atomic<bool> over{false};
  std::atomic<std::uint64_t> allocations{0};
  rt::tripwire::report served;
  std::thread service{[&] {
    const std::string reply(50, 'y');
    auto wire = rt::tripwire::arm();
    while (!over) {
      h.submissions.take([&](std::uint32_t slot) { h.submissions.complete(slot, {}, reply); }, SIZE_MAX);
      (void)h.inbox.deliver({}, reply);
    }
    served = wire.disarm();
  }};
  for (int generation = 0; generation != generations; ++generation) {
    std::vector<std::thread> users;
    for (int i = 0; i != threads_each; ++i) users.emplace_back([&] { allocations += use(h); });
    for (std::thread& user : users) user.join();
  }
  over = true;
  service.join();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(served.allocations, 0U);
  EXPECT_EQ(served.locks, 0U);
  h.submissions.finish();
  while (const auto left = h.inbox.try_receive(rt::time_point{})) h.inbox.release(*left);
  EXPECT_STREQ(h.submissions.check(), nullptr);
  EXPECT_STREQ(h.inbox.check(), nullptr);
  EXPECT_TRUE(h.submissions.all_free() && h.inbox.all_free());
}

TEST(submissions_allocations, are_none_at_set_up_either) {
  std::optional<fixture> h;
  auto wire = rt::tripwire::arm();
  h.emplace();
  const auto seen = wire.disarm();
  EXPECT_EQ(seen.allocations, 0U);
}

// Both sides in one thread, so that nobody sleeps: no system call, no page fault, no wait, nothing.
TEST(submissions_allocations, are_not_all_that_is_missing_while_nobody_sleeps) {
  fixture h;
  constexpr int requests = 1000;
  int completed = 0;
  int arrived = 0;
  std::string findings = "skipped";
  std::thread{[&] {
    if (!rt::tripwire::watch_system_calls()) return;
    const std::string text(100, 'x');
    for (int run = 0; run != 2; ++run) { // the first pages in what the thread itself needs
      completed = arrived = 0;
      auto wire = rt::tripwire::arm();
      for (int i = 0; i != requests; ++i) {
        const bool waits = i % 2 == 0;
        const auto asked = h.submissions.submit({.wants_outcome = waits}, text);
        h.submissions.take([&](std::uint32_t slot) { h.submissions.complete(slot, {}, text); }, SIZE_MAX);
        if (waits ? h.submissions.wait(*asked, rt::never) : h.submissions.drained()) ++completed;
        if (waits) h.submissions.release(*asked);
        (void)h.inbox.deliver({}, text);
        if (const auto slot = h.inbox.receive(rt::never)) {
          ++arrived;
          h.inbox.release(*slot);
        }
      }
      const auto seen = wire.disarm();
      std::array<char, 200> buffer;
      findings = seen.clean() ? "" : std::string{seen.text(buffer)};
    }
  }}.join();
  if (findings == "skipped") GTEST_SKIP() << "the kernel does not let system calls be watched";
  EXPECT_EQ(completed, requests);
  EXPECT_EQ(arrived, requests);
  EXPECT_EQ(findings, "");
}

} // namespace
