// SPDX-License-Identifier: Apache-2.0
// A child of fork(): what it does with an endpoint of its parent changes nothing there.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <rowe/ros.hpp>

#include "endpoints.hpp"
#include "every_call.hpp"
#include "rt/sanitized.hpp"

namespace fork_test {
namespace {

using namespace endpoints;
using rowe::errc;
using rowe::json_text;
using pose = rowe::ros::pose;

// What `act` returns in a child, which then ends by `end`.
template <class Act>
std::string in_child(Act&& act, void (*end)(int) = ::_exit) {
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    const std::string said = act();
    const bool whole = ::write(pipe[1], said.data(), said.size()) == static_cast<::ssize_t>(said.size());
    end(whole ? 0 : 1);
  }
  ::close(pipe[1]);
  std::string said;
  std::array<char, 512> some;
  for (::ssize_t got = 0; (got = ::read(pipe[0], some.data(), some.size())) > 0;)
    said.append(some.data(), static_cast<std::size_t>(got));
  ::close(pipe[0]);
  int outcome = 0;
  if (child < 0 || ::waitpid(child, &outcome, 0) != child) return "no child";
  if (WIFSIGNALED(outcome)) said += " ended by signal " + std::to_string(WTERMSIG(outcome));
  if (WIFEXITED(outcome) && WEXITSTATUS(outcome) != 0)
    said += " ended with " + std::to_string(WEXITSTATUS(outcome));
  return said;
}

rowe::endpoint_options unguarded() {
  auto options = quick();
  options.stop.unguarded = true;
  return options;
}

// A robot with one handle of each kind, whose loop may move.
struct robot {
  robot() { EXPECT_TRUE(is_released()); }
  // Whether the loop may move once it is let go.
  bool is_released() {
    return eventually([this] {
      const bool moves = !latch.engaged();
      latch.acknowledge();
      return moves || (endpoint.reset_emergency_stop({}, timeout) && !latch.engaged());
    });
  }
  rowe::endpoint endpoint = rowe::endpoint::listen(0, unguarded()).value();
  rowe::parameter<double> gain = endpoint.parameter<double>("gain", 1.0).value();
  rowe::stop_latch latch = endpoint.stop_latch({.name = "loop", .loop_timeout = 10s}).value();
  handles loops{endpoint.advertise<pose>("/pose").value(),
                endpoint.advertise<json_text>("/map", {.text_bytes_max = 100'000}).value(),
                endpoint.subscribe<pose>("/goal").value(),
                endpoint.subscribe<pose>("/goal", {.keep = rowe::keep::newest}).value(),
                endpoint.subscribe<json_text>("/words").value(),
                endpoint.serve<pose, pose>("/plan").value(),
                endpoint.serve<json_text, json_text>("/say").value(),
                endpoint.client<pose, pose>("/remote").value(),
                endpoint.client<json_text, json_text>("/ask").value(),
                endpoint.open_lane().value()};
};

// What its child has to say of it.
std::string handles_of_another(robot& of) {
  std::string wrong = calls_without(errc::forked, of.loops);
  if (of.gain.set(2.0).code() != errc::forked) wrong += "parameter set: of nobody else\n";
  if (of.gain.get() != 1.0) wrong += "parameter get: another value\n";
  if (!of.latch.engaged()) wrong += "a latch that nobody guards is not engaged\n";
  of.latch.acknowledge();
  return wrong;
}

// Whether a client can still come in, hear what the robot publishes, and be heard.
void expect_alive(robot& at) {
  auto client = connected(at.endpoint);
  auto hears = client.subscribe<pose>("/pose").value();
  auto speaks = client.advertise<pose>("/goal").value();
  EXPECT_TRUE(eventually([&] {
    (void)at.loops.publishes.publish({});
    return bool{hears.try_take()};
  }));
  EXPECT_TRUE(eventually([&] {
    (void)speaks.publish({});
    return bool{at.loops.hears.try_take()};
  }));
  EXPECT_TRUE(at.is_released());
}

TEST(fork, leaves_a_child_that_is_told_by_every_call_whose_the_endpoint_is) {
  robot of_parent;
  auto client = connected(of_parent.endpoint);
  const auto speaks = client.advertise<pose>("/goal").value();
  EXPECT_EQ(in_child([&] { return calls_without(errc::forked, of_parent.endpoint); }), "");
  EXPECT_EQ(in_child([&] { return handles_of_another(of_parent); }), "");
  expect_alive(of_parent);
}

TEST(fork, leaves_the_parent_what_came_before_it) {
  robot of_parent;
  auto client = connected(of_parent.endpoint);
  auto speaks = client.advertise<pose>("/goal").value();
  const auto publishes = [&] {
    (void)speaks.publish({});
    return count_of(of_parent.endpoint, "messages_in") > 10; // and what its advertise() takes
  };
  EXPECT_TRUE(eventually(publishes));
  EXPECT_EQ(in_child([&] { return handles_of_another(of_parent); }), "");
  EXPECT_TRUE(of_parent.loops.hears.try_take());
  EXPECT_TRUE(of_parent.loops.hears_newest.latest());
}

TEST(fork, leaves_a_child_whose_destructors_touch_nothing_of_the_parent) {
  auto of_parent = std::make_unique<robot>();
  EXPECT_EQ(in_child([&] {
              of_parent.reset();
              return std::string{};
            }),
            "");
  expect_alive(*of_parent);
}

// exec() failed, and the child returns from main(): what is static is destroyed.
TEST(fork, leaves_a_child_that_may_exit) {
  static std::optional<robot> of_parent;
  of_parent.emplace();
  EXPECT_EQ(in_child([] { return std::string{}; }, std::exit), "");
  expect_alive(*of_parent);
  of_parent.reset();
}

TEST(fork, of_a_child_says_the_same) {
  robot of_parent;
  EXPECT_EQ(in_child([&] { return in_child([&] { return handles_of_another(of_parent); }); }), "");
  expect_alive(of_parent);
}

// Another thread opens and closes endpoints all the time, and has perhaps just begun when the process forks.
TEST(fork, may_come_while_endpoints_are_opened_and_closed) {
  std::atomic<bool> done{false};
  std::thread opens{[&] {
    while (!done.load()) (void)rowe::endpoint::listen(0, quick()).value();
  }};
  robot of_parent;
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(in_child([&] { return calls_without(errc::forked, of_parent.endpoint); }), "");
  done.store(true);
  opens.join();
  expect_alive(of_parent);
}

TEST(fork, leaves_a_child_that_can_open_endpoints_of_its_own) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "a sanitizer does not follow threads that a child begins";
#endif
  robot of_parent;
  const auto alive = [] {
    robot of_child;
    auto client = connected(of_child.endpoint);
    auto hears = client.subscribe<pose>("/pose").value();
    const bool heard = eventually([&] {
      (void)of_child.loops.publishes.publish({});
      return bool{hears.try_take()};
    });
    return std::string{heard ? "" : "nothing is heard"};
  };
  EXPECT_EQ(in_child(alive), "");
  expect_alive(of_parent);
}

} // namespace
} // namespace fork_test
