// SPDX-License-Identifier: Apache-2.0
// The contract with the real service thread at the other end of the queue pairs: it takes what is published,
// asked and answered and brings it to the handles it is for, on memory of the endpoint, while the loop's
// calls are watched.
#include "contract.hpp"

#include <rowe/rowe.hpp>
#include <rowe/rt/thread.hpp>

#include "rt/watchdog.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

struct service_contract_pose {
  double stamp, x, y;
};
template <>
inline constexpr auto rowe::schema<service_contract_pose> =
    rowe::fields<&service_contract_pose::stamp, &service_contract_pose::x, &service_contract_pose::y>{};

namespace rowe::contract {
namespace {

using namespace std::chrono_literals;
using pose = service_contract_pose;

struct endpoint_with_a_listener {
  explicit endpoint_with_a_listener(idle policy = idle::poll)
      : robot{endpoint::listen(0, {.idle_policy = policy}).value()} {}
  endpoint robot;
  subscriber<json_text> seen = robot.subscribe<json_text>("/pose", {.depth = 64}).value();
};

// Calls cycle(i) from a watched real-time thread, which may write to `wake_descriptor`, and meanwhile() from
// this one.
template <class Cycle, class Meanwhile = void (*)()>
rt::tripwire::report watch_a_loop(
    std::uint64_t cycles, Cycle cycle, int wake_descriptor = -1, Meanwhile meanwhile = [] {}) {
  rt::tripwire::report report;
  std::string trouble;
  {
    const rt::thread loop{{.name = "loop"}, [&] {
                            if (!rt::tripwire::watch_system_calls())
                              trouble = "system calls cannot be watched";
                            rt::tripwire::expect_writes_to(wake_descriptor);
                            for (std::uint64_t i = 0; i < 1000; ++i) cycle(i);
                            (void)rt::tripwire::arm().disarm();
                            auto wire = rt::tripwire::arm();
                            for (std::uint64_t i = 0; i < cycles; ++i) cycle(i);
                            report = wire.disarm();
                          }};
    EXPECT_EQ(loop.error(), 0);
    if (loop.error() == 0) meanwhile();
  }
  EXPECT_EQ(trouble, "");
  return report;
}

// Publishes and takes what comes back; the number of messages taken is added to `taken`.
rt::tripwire::report publish_and_take(publisher<pose>& odom, subscriber<json_text>& seen,
                                      std::uint64_t cycles, std::uint64_t& taken) {
  return watch_a_loop(cycles, [&](std::uint64_t i) {
    use(odom.publish({static_cast<double>(i), 1, 2}, rt::monotonic_clock::now()));
    if (const auto message = seen.try_take()) taken += message->value().size() != 0;
  });
}

std::string text(const rt::tripwire::report& report) {
  char buffer[300];
  return std::string{report.text(buffer)};
}

// Until the service thread has seen the subscription.
void wait_until_wanted(const publisher<pose>& odom) {
  while (!odom.wanted()) std::this_thread::yield();
}

TEST(rt_contract, is_kept_by_a_loop_beside_a_working_service_thread) {
  const tests::watchdog guard{"a loop beside the service thread"};
  for (const rowe::keep kept : {rowe::keep::all, rowe::keep::newest}) {
    endpoint_with_a_listener e;
    auto odom = e.robot.advertise<pose>("/pose", {.keep = kept}).value();
    wait_until_wanted(odom);
    std::uint64_t taken = 0;
    const auto report = publish_and_take(odom, e.seen, calls_made, taken);
    EXPECT_TRUE(report.clean()) << text(report);
    while (taken == 0) { // what was published last may still be on its way
      if (e.seen.try_take()) ++taken;
      std::this_thread::yield();
    }
  }
}

// Under idle::wake, by a loop that waits for each value to come back, so that the service thread sleeps
// before the next one.
TEST(rt_contract, is_kept_under_wake_beside_a_working_service_thread_but_for_writes_to_its_descriptor) {
  const tests::watchdog guard{"a loop that wakes the service thread"};
  constexpr std::uint64_t cycles = 3000;
  for (const rowe::keep kept : {rowe::keep::all, rowe::keep::newest}) {
    endpoint_with_a_listener e{idle::wake};
    auto odom = e.robot.advertise<pose>("/pose", {.keep = kept}).value();
    wait_until_wanted(odom);
    const auto report = watch_a_loop(
        cycles,
        [&](std::uint64_t i) {
          if (!odom.publish({static_cast<double>(i), 1, 2}, rt::monotonic_clock::now())) return;
          while (!e.seen.try_take()) continue;
        },
        e.robot.wake_descriptor());
    EXPECT_TRUE(report.clean()) << text(report);
    EXPECT_GT(report.wake_writes, 0u);
    EXPECT_LE(report.wake_writes, cycles);
  }
}

TEST(rt_contract, names_no_descriptor_that_handles_write_to_but_under_wake) {
  EXPECT_EQ(endpoint_with_a_listener{idle::poll}.robot.wake_descriptor(), -1);
  EXPECT_EQ(endpoint_with_a_listener{idle::spin}.robot.wake_descriptor(), -1);
  EXPECT_GE(endpoint_with_a_listener{idle::wake}.robot.wake_descriptor(), 0);
}

// One loop that asks itself, with structs and with text, and answers, refuses, drops and cancels.
struct loop_that_calls {
  endpoint robot = endpoint::listen(0, {.limits = {.handle_bytes = 2 * 1024 * 1024}}).value();
  responder<pose, pose> answers = robot.serve<pose, pose>("/same").value();
  caller<pose, pose> asks = robot.client<pose, pose>("/same").value();
  rowe::lane talk = robot.open_lane().value();
  std::uint64_t replies = 0;

  void cycle(std::uint64_t i) {
    const auto now = rt::monotonic_clock::now();
    if (auto asked = answers.try_next(now)) {
      if (i % 8 == 0) use(answers.refuse(*asked, "not now", now));
      if (i % 8 != 1)
        use(answers.reply(*asked, asked->value(), now)); // else it is dropped, or answered twice
    }
    if (const auto begun = asks.start({static_cast<double>(i), 1, 2}, 1ms, now); begun && i % 16 == 0)
      asks.cancel(*begun);
    use(talk.start(message{"service", "same", "stamp", i, "x", 1, "y", 2}, 1ms, now));
    use(talk.start(message{"service", "echo", "n", i}, 1ms, now)); // for a peer, and there is none
    use(talk.try_send(message{"n", i}, 100us, now));               // likewise
    if (const auto came = talk.try_receive(now)) use(came->value().size());
    while (const auto ended = asks.try_finish()) replies += ended->reply.has_value();
    while (const auto ended = talk.try_finish()) replies += ended->reply.has_value();
  }
};

TEST(rt_contract, is_kept_by_a_loop_that_calls_and_answers_beside_a_working_service_thread) {
  const tests::watchdog guard{"a loop that calls beside the service thread"};
  loop_that_calls loop;
  const auto report = watch_a_loop(calls_made, [&](std::uint64_t i) { loop.cycle(i); });
  EXPECT_TRUE(report.clean()) << text(report);
  while (loop.replies == 0) { // the last ones may still be on their way
    loop.cycle(2);
    std::this_thread::yield();
  }
}

// The endpoint closes between two steps of the loop's calls.
TEST(rt_contract, is_kept_by_a_loop_whose_endpoint_closes) {
  const tests::watchdog guard{"a loop whose endpoint closes"};
  loop_that_calls loop;
  auto odom = loop.robot.advertise<pose>("/pose").value();
  auto seen = loop.robot.subscribe<json_text>("/pose").value();
  auto latch = loop.robot.stop_latch().value();
  std::atomic<std::uint64_t> cycles{0};
  std::atomic<bool> is_closed{false};
  std::uint64_t cycles_after = 0;
  const auto every_call = [&](std::uint64_t i) {
    const auto now = rt::monotonic_clock::now();
    if (is_closed) ++cycles_after;
    loop.cycle(i);
    use(odom.publish({static_cast<double>(i), 1, 2}, now));
    use(seen.try_take());
    if (latch.engaged(now)) latch.acknowledge(now);
    ++cycles;
  };
  const auto report = watch_a_loop(
      1,
      [&](std::uint64_t i) {
        every_call(i);
        // The thousand cycles before what is watched have been made: from now on until it is closed.
        for (std::uint64_t next = i; cycles > 1000 && cycles_after < 1000; ++next) every_call(next);
      },
      -1,
      [&] {
        while (cycles < 3000) std::this_thread::yield();
        use(loop.robot.close()); // what nobody has taken is lost: timed_out
        is_closed = true;
      });
  EXPECT_TRUE(report.clean()) << text(report);
  const auto now = rt::monotonic_clock::now();
  EXPECT_EQ(odom.publish({}, now).code(), errc::closed);
  EXPECT_TRUE(latch.engaged(now));
}

TEST(rt_contract, needs_no_allocation_per_message_in_the_whole_process) {
  const tests::watchdog guard{"a process that does not allocate"};
  endpoint_with_a_listener e;
  auto odom = e.robot.advertise<pose>("/pose", {.keep = rowe::keep::newest}).value();
  wait_until_wanted(odom);
  std::atomic<bool> start{false}, done{false};
  std::uint64_t taken = 0;
  // Everything that allocates stands outside of what is counted: the loop's thread runs already, and still
  // runs.
  const rt::thread loop{{.name = "loop"}, [&] {
                          for (std::uint64_t i = 0; taken < 2000; ++i) {
                            if (taken >= 100) start = true; // both threads have done everything once
                            (void)odom.publish({static_cast<double>(i), 1, 2}, rt::monotonic_clock::now());
                            if (const auto message = e.seen.try_take()) ++taken;
                          }
                          done = true;
                        }};
  while (!start) std::this_thread::yield();
  const std::uint64_t before = rt::tripwire::process_allocations();
  while (!done) std::this_thread::yield();
  EXPECT_EQ(rt::tripwire::process_allocations() - before, 0u);
}

} // namespace
} // namespace rowe::contract
