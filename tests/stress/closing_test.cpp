// SPDX-License-Identifier: Apache-2.0
// Endpoints that close at any moment: while in each call that waits one thread waits without a limit, and
// loops make the calls that do not wait. Nobody is left waiting: each thread gets its results, and then
// `closed`; and the endpoint's counters add up.
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <thread>
#include <vector>

#include "rt/seed.hpp"
#include "rt/watchdog.hpp"
#include "stress/factor.hpp"
#include "stress/traffic.hpp"

namespace {

using namespace traffic;
using rowe::errc;
using rowe::message;
using rowe::rt::for_ever;
using rowe::tests::stressed;
using rowe::tests::watchdog;

// Calls `once()` on a thread of its own until that returns `closed`. Other errors must be among `possible`.
class until_closed {
 public:
  until_closed(std::deque<std::thread>& threads, failures& to) : threads_{threads}, to_{to} {}

  template <class Once>
  void run(const char* what, std::initializer_list<errc> possible, Once once) {
    threads_.emplace_back(
        [this, what, possible = std::vector<errc>{possible}, once = std::move(once)]() mutable {
          ++running_;
          for (;;) {
            const auto got = once();
            if (got) continue;
            if (got.code() == errc::closed) return;
            if (std::find(possible.begin(), possible.end(), got.code()) == possible.end())
              to_.add(what, got.error().name());
            std::this_thread::yield();
          }
        });
  }
  std::size_t running() const { return running_; }

 private:
  std::deque<std::thread>& threads_;
  failures& to_;
  std::atomic<std::size_t> running_{0};
};

// Everything that waits, at one endpoint. `other`: a service of the other end.
void wait_everywhere(rowe::endpoint& at, const char* own, const char* other, until_closed& threads) {
  threads.run("send", {errc::full}, [&at] { return at.send("{}", for_ever); });
  threads.run("invoke", {errc::peer_lost, errc::full, errc::no_service, errc::refused, errc::timed_out},
              [&at] {
                return at.invoke(message{"service", "echo", "n", 1}, for_ever);
              });
  threads.run("receive", {}, [&at]() -> rowe::status {
    const auto came = at.receive(for_ever);
    if (!came) return came.error();
    if (!came->wants_reply()) return {};
    const auto said = at.reply(*came, "{}", for_ever);
    if (said.code() == errc::closed && !said) return errc::closed;
    return {};
  });
  threads.run("lane::send", {}, [talk = at.open_lane(small_lane(false)).value()]() mutable {
    return talk.send("{}", for_ever);
  });
  threads.run("lane::receive", {},
              [talk = at.open_lane(small_lane(false)).value()]() mutable { return talk.receive(for_ever); });
  threads.run("lane::invoke", {errc::peer_lost, errc::full, errc::no_service, errc::refused, errc::timed_out},
              [talk = at.open_lane(small_lane(false)).value()]() mutable {
                return talk.invoke(message{"service", "echo", "n", 1}, for_ever);
              });
  threads.run("take", {}, [seen = at.subscribe<reading>("/readings", {.depth = 4}).value()]() mutable {
    return seen.take(for_ever);
  });
  threads.run("next", {},
              [provides = at.serve<addends, total>(own, small_service).value()]() mutable -> rowe::status {
                auto asked = provides.next(for_ever);
                if (!asked) return asked.error();
                (void)provides.reply(*asked, {asked->value().a + asked->value().b}); // the caller may be gone
                return {};
              });
  threads.run("call", {errc::peer_lost, errc::full, errc::no_service, errc::refused, errc::timed_out},
              [calls = at.client<addends, total>(other, small_service).value(),
               readings = at.advertise<reading>("/readings").value()]() mutable {
                (void)readings.publish({1, 2}); // for take(); the call says when it is closed
                return calls.call({1, 2}, for_ever);
              });
  threads.run("wait_peer", {errc::timed_out}, [&at]() -> rowe::status {
    if (const auto there = at.wait_peer(for_ever); !there) return there;
    const auto came = at.receive(1ms); // lest it asks all the time
    return came ? rowe::status{} : rowe::status{came.error()};
  });
}

TEST(closing_stress, leaves_nobody_waiting) {
  const watchdog dog{"threads that wait while their endpoint closes", 500s};
  const rowe::tests::test_seed seed;
  random_source random{seed};
  for (std::uint64_t round = 0; round != stressed(4); ++round) {
    failures wrong;
    auto robot = rowe::endpoint::listen(0, options()).value();
    auto desk = rowe::endpoint::connect(url_of(robot), options()).value();
    if (random.below(2) == 0) { // else they wait for each other, too
      ASSERT_TRUE(desk.wait_peer(20s));
    }
    std::deque<std::thread> threads;
    until_closed waiting{threads, wrong};
    wait_everywhere(robot, "at_robot", "at_desk", waiting);
    wait_everywhere(desk, "at_desk", "at_robot", waiting);
    while (waiting.running() != threads.size()) std::this_thread::yield();
    for (std::uint64_t turns = random.below(300); turns != 0; --turns) std::this_thread::yield();
    rowe::endpoint& first = random.below(2) == 0 ? robot : desk;
    rowe::endpoint& second = &first == &robot ? desk : robot;
    (void)first.close(random.time()); // what is in flight may take longer than that
    for (std::uint64_t turns = random.below(300); turns != 0; --turns) std::this_thread::yield();
    (void)second.close(random.time());
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(wrong.text(), "");
  }
}

} // namespace
