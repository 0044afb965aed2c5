// SPDX-License-Identifier: Apache-2.0
// The stop through the public interface, over sockets: loops of this process, a peer that asks.
#include <rowe/rowe.hpp>
#include <rowe/rt/thread.hpp>

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "endpoints.hpp"

namespace stop_test {
namespace {

using namespace std::chrono_literals;
using rowe::endpoint;
using rowe::errc;

using endpoints::timeout;

// A loop that obeys, in a thread of its own.
class obedient {
 public:
  explicit obedient(rowe::stop_latch latch, bool acknowledges = true)
      : latch_{std::move(latch)}, thread_{[this, acknowledges] {
          while (!over_) {
            const bool engaged = latch_.engaged();
            moving_ = !engaged;
            if (!engaged) has_moved_ = true;
            if (engaged && acknowledges) latch_.acknowledge();
            std::this_thread::yield();
          }
        }} {}
  ~obedient() {
    over_ = true;
    thread_.join();
  }
  bool moving() const { return moving_; }
  bool has_moved() const { return has_moved_; }
  bool becomes(bool moving) const {
    return endpoints::eventually([&] { return moving_ == moving; });
  }

 private:
  rowe::stop_latch latch_;
  std::atomic<bool> over_ = false;
  std::atomic<bool> moving_ = false;
  std::atomic<bool> has_moved_ = false;
  std::thread thread_;
};

// None of the stop's times runs out by itself, however late a thread of a busy machine is run; a test that is
// about one of them sets it.
constexpr auto out_of_the_way = 10s;

rowe::endpoint_options unguarded() {
  rowe::endpoint_options options;
  options.stop.unguarded = true;
  options.stop.service_timeout = out_of_the_way;
  options.stop.observe_timeout = out_of_the_way;
  return options;
}

rowe::stop_latch latch(endpoint& of, std::string_view name = "loop") {
  return of.stop_latch({.name = name, .loop_timeout = out_of_the_way}).value();
}

std::string state_of(endpoint& robot) {
  return std::string{robot.invoke(rowe::message{"service", "/rowe/stop/state"}, timeout).value().value()};
}
bool says(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

bool moves_again(endpoint& of, const obedient& loop) {
  return of.reset_emergency_stop({}, timeout) && loop.becomes(true);
}

TEST(stop, holds_at_the_start_until_it_is_reset) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  EXPECT_TRUE(loop.becomes(false));
  EXPECT_TRUE(moves_again(robot, loop));
}

TEST(stop, asked_for_in_this_process_is_acknowledged) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  const auto before = rowe::rt::monotonic_clock::now();
  const auto stopped = robot.emergency_stop({.source = "a button"}, timeout);
  ASSERT_TRUE(stopped) << stopped.error().name();
  EXPECT_GE(stopped->acknowledged, before);
  EXPECT_LE(stopped->acknowledged, rowe::rt::monotonic_clock::now());
  EXPECT_TRUE(loop.becomes(false));
  EXPECT_TRUE(moves_again(robot, loop));
}

TEST(stop, asked_for_by_a_peer_is_acknowledged_with_times) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  auto peer = endpoints::connected(robot);
  const auto answer = peer.invoke(rowe::message{"service", "/rowe/stop", "source", "test"}, timeout);
  ASSERT_TRUE(answer) << answer.error().name();
  for (const char* const part : {R"("state":"stopped")", R"("source":"test")", R"("observed_ns":")"})
    EXPECT_TRUE(says(std::string{answer->value()}, part)) << answer->value();
  EXPECT_FALSE(loop.moving());
}

TEST(stop, nobody_acknowledges_is_said_to_be_so) {
  rowe::endpoint_options options = unguarded();
  options.stop.observe_timeout = 50ms;
  auto robot = endpoint::listen(0, options).value();
  obedient loop{latch(robot), false};
  EXPECT_EQ(robot.emergency_stop({.source = "a button"}, timeout).code(), errc::timed_out);
  EXPECT_EQ(robot.reset_emergency_stop({}, 20ms).code(), errc::timed_out);
}

TEST(stop, has_times_that_follow_the_threads_they_watch) {
  using reason = rowe::stop_times::reason;
  char text[rowe::stop_times::text_bytes_max];
  auto robot = endpoint::listen(0).value();
  rowe::stop_latch ordinary, urgent, chosen;
  {
    const rowe::rt::thread loop{{}, [&] { ordinary = robot.stop_latch().value(); }};
  }
  EXPECT_EQ(ordinary.times().text(text), "loop_timeout 500 ms (a thread without real-time priority), "
                                         "service_timeout 250 ms (a thread without real-time priority)");
  rowe::rt::thread loop{{.priority = 1}, [&] {
                          urgent = robot.stop_latch().value();
                          chosen = robot.stop_latch({.loop_timeout = 1500us}).value();
                        }};
  loop.join();
  const bool granted = static_cast<bool>(loop.grants().fifo);
  EXPECT_EQ(urgent.times().loop, granted ? reason::real_time_priority : reason::ordinary_priority);
  EXPECT_EQ(urgent.times().loop_timeout, granted ? 100ms : 500ms);
  EXPECT_EQ(urgent.times().service_timeout, 250ms);
  EXPECT_EQ(chosen.times().text(text), "loop_timeout 1500 us (as the options say), "
                                       "service_timeout 250 ms (a thread without real-time priority)");

  auto served = endpoint::listen(0, {.service_priority = 1}).value();
  const bool in_time = static_cast<bool>(served.service_grants().fifo);
  EXPECT_EQ(served.stop_latch()->times().service_timeout, in_time ? 50ms : 250ms);
  auto told = endpoint::listen(0, {.stop = {.service_timeout = 3ms}}).value();
  EXPECT_EQ(told.stop_latch()->times().service, reason::option);
  EXPECT_EQ(endpoint::listen(0, {.stop = {.service_timeout = 1ms}}).error(),
            (rowe::error{errc::bad_argument, 1'000'000, 2'000'000, rowe::argument::service_timeout}));
}

TEST(stop, has_a_text_of_its_times_that_fits) {
  const auto longest = rowe::duration{std::numeric_limits<std::int64_t>::min()};
  rowe::stop_times times{longest, rowe::stop_times::reason::ordinary_priority, longest,
                         rowe::stop_times::reason::ordinary_priority};
  char text[rowe::stop_times::text_bytes_max];
  EXPECT_TRUE(times.text(text).ends_with("priority)")) << times.text(text);
}

TEST(stop, without_guards_is_not_reset) {
  auto robot = endpoint::listen(0).value();
  obedient loop{latch(robot)};
  EXPECT_EQ(robot.reset_emergency_stop({}, timeout).code(), errc::refused);
  EXPECT_FALSE(loop.moving());
}

TEST(stop, comes_even_where_there_is_no_time_to_wait_and_no_room_to_ask) {
  rowe::endpoint_options options = unguarded();
  options.limits.door_slots = 4;
  auto robot = endpoint::listen(0, options).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  const auto done = robot.emergency_stop({.source = "no time"}, 0ms); // perhaps in time, by chance
  EXPECT_TRUE(done || done.code() == errc::timed_out) << done.error().name();
  EXPECT_TRUE(loop.becomes(false));

  ASSERT_TRUE(moves_again(robot, loop));
  // All slots, for good: what the service thread has room for further on leaves its slot in the next cycle.
  const auto cycles = [&] { return endpoints::count_of(robot, "cycles"); };
  for (std::uint64_t last = cycles();;) {
    const std::uint64_t before = cycles();
    const bool taken{robot.try_send(rowe::message{"waits", "for a peer"}, rowe::rt::for_ever)};
    if (taken) last = cycles();
    if (!taken && before >= last + 3) break;
  }
  EXPECT_TRUE(robot.emergency_stop({.source = "no room"}, timeout)); // nor does its answer need any
  EXPECT_TRUE(loop.becomes(false));
}

TEST(stop, comes_when_the_endpoint_begins_to_close) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  ASSERT_TRUE(
      robot.try_send(rowe::message{"waits", "for a peer"}, rowe::rt::for_ever)); // so it drains for long
  std::thread closing{[&] { (void)robot.close(2s); }};
  const auto began = rowe::rt::monotonic_clock::now();
  EXPECT_TRUE(loop.becomes(false));
  const bool while_draining = rowe::rt::monotonic_clock::now() < began + 2s;
  closing.join();
  if (!while_draining) GTEST_SKIP() << "the machine was too slow to see it";
}

TEST(stop, of_a_robot_without_a_latch_is_no_service) {
  auto robot = endpoint::listen(0).value();
  EXPECT_EQ(robot.emergency_stop({}, timeout).code(), errc::no_service);
  EXPECT_EQ(robot.reset_emergency_stop({}, timeout).code(), errc::no_service);
}

TEST(stop, of_a_client_without_a_latch_is_not_its_servers) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  auto viewer = endpoints::connected(robot);
  const std::uint64_t stops = endpoints::count_of(robot, "stops");
  EXPECT_EQ(viewer.emergency_stop({.source = "viewer"}, timeout).code(), errc::no_service);
  ASSERT_TRUE(viewer.invoke(rowe::message{"service", "/rowe/stop/state"}, timeout)); // behind it
  EXPECT_EQ(endpoints::count_of(robot, "stops"), stops);
}

TEST(stop, says_who_and_why_and_is_cut_where_there_is_no_room_for_more) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(robot.reset_emergency_stop({}, timeout));
  while (robot.try_event()) {
  }
  // 63 and 192 bytes end within an umlaut.
  const std::string source = std::string(62, 's') + "\u00fc and more";
  const std::string reason = std::string(191, 'r') + "\u00fc and more";
  const auto stopped = robot.emergency_stop({.source = source, .reason = reason}, timeout);
  ASSERT_TRUE(stopped) << stopped.error().name();
  const auto told = robot.try_event();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->what_kind, rowe::event::kind::stop);
  EXPECT_EQ(std::string_view{told->peer}, std::string(62, 's'));
  EXPECT_EQ(std::string_view{told->what}, "stopped: request, '" + std::string(191, 'r') + "'");
  const std::string state = state_of(robot);
  EXPECT_TRUE(says(state, R"("cause":"request","source":")" + std::string(62, 's') + '"')) << state;
  EXPECT_TRUE(says(state, R"("number":)" + std::to_string(stopped->number) + ',')) << state;
}

TEST(stop, whose_number_is_named_is_reset_and_no_other) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  const auto first = robot.emergency_stop({.source = "first"}, timeout).value();
  const auto second = robot.emergency_stop({.source = "second"}, timeout).value();
  EXPECT_NE(first.number, second.number);
  EXPECT_EQ(robot.reset_emergency_stop({.number = first.number}, timeout).code(), errc::refused);
  EXPECT_FALSE(loop.moving());
  const auto moves = robot.reset_emergency_stop({.number = second.number}, timeout);
  ASSERT_TRUE(moves) << moves.error().name();
  EXPECT_TRUE(says(state_of(robot), R"("number":)" + std::to_string(moves->number) + ','));
  EXPECT_TRUE(loop.becomes(true));
  EXPECT_EQ(robot.reset_emergency_stop({}, timeout).value().number, moves->number); // it moves already
}

TEST(stop, that_was_not_reset_in_time_is_not_reset_later) {
  auto robot = endpoint::listen(0, unguarded()).value();
  auto base = latch(robot);
  (void)base.engaged(); // and does not acknowledge
  EXPECT_EQ(robot.reset_emergency_stop({}, 20ms).code(), errc::timed_out);
  base.acknowledge();
  for (int i = 0; i < 3; ++i) (void)state_of(robot); // each takes a cycle
  EXPECT_TRUE(base.engaged());
}

TEST(stop, asked_for_by_several_threads_at_once_is_acknowledged_to_each) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  std::atomic<int> acknowledged = 0;
  std::atomic<int> refused = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int j = 0; j < 50; ++j) {
        const std::string source = "thread " + std::to_string(i);
        if (robot.emergency_stop({.source = source}, timeout)) ++acknowledged;
        // Whoever is overtaken by another's stop is refused.
        if (robot.reset_emergency_stop({}, timeout).code() == errc::refused) ++refused;
      }
    });
  }
  for (std::thread& one : threads) one.join();
  EXPECT_EQ(acknowledged, 200);
  EXPECT_LT(refused, 200);
}

TEST(stop, ends_with_the_endpoint_for_whoever_waits) {
  auto robot = endpoint::listen(0, unguarded()).value();
  auto base = latch(robot); // it never looks
  std::atomic<errc> stopped{errc::misuse};
  std::atomic<errc> reset{errc::misuse};
  std::thread stops{[&] { stopped = robot.emergency_stop({}, timeout).code(); }};
  std::thread resets{[&] { reset = robot.reset_emergency_stop({}, timeout).code(); }};
  ASSERT_TRUE(endpoints::eventually([&] { return endpoints::count_of(robot, "stops") != 0; }));
  ASSERT_TRUE(robot.close());
  stops.join();
  resets.join();
  EXPECT_EQ(stopped, errc::closed);
  EXPECT_TRUE(reset == errc::closed || reset == errc::refused); // closing is a stop, too
  EXPECT_EQ(robot.emergency_stop({}, timeout).code(), errc::closed);
  EXPECT_EQ(robot.reset_emergency_stop({}, timeout).code(), errc::closed);
  EXPECT_TRUE(base.engaged());
}

TEST(stop, comes_when_a_loop_goes) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient base{latch(robot, "base")};
  {
    obedient arm{latch(robot, "arm")};
    ASSERT_TRUE(robot.reset_emergency_stop({}, timeout));
    ASSERT_TRUE(base.becomes(true));
  }
  EXPECT_TRUE(base.becomes(false));
}

TEST(stop, comes_when_the_endpoint_closes_and_stays) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient loop{latch(robot)};
  ASSERT_TRUE(moves_again(robot, loop));
  ASSERT_TRUE(robot.close());
  EXPECT_TRUE(loop.becomes(false));
}

TEST(stop, comes_when_a_loop_does_not_look_in_time) {
  auto robot = endpoint::listen(0, unguarded()).value();
  obedient base{latch(robot, "base")};
  auto slow = robot.stop_latch({.name = "slow", .loop_timeout = 1s}).value();
  // Again, should the machine keep `slow` from looking before `base` has moved.
  const auto until = rowe::rt::monotonic_clock::now() + timeout;
  const auto waits = [&] { return !base.has_moved() && rowe::rt::monotonic_clock::now() < until; };
  std::thread resets{[&] {
    while (waits()) (void)robot.reset_emergency_stop({}, timeout);
  }};
  while (waits()) {
    if (slow.engaged()) slow.acknowledge();
  }
  resets.join();
  ASSERT_TRUE(base.has_moved());
  EXPECT_TRUE(base.becomes(false)); // `slow` is not asked any more
  EXPECT_TRUE(says(state_of(robot), R"("cause":"loop","source":"slow")"));
}

} // namespace
} // namespace stop_test
