// SPDX-License-Identifier: Apache-2.0
// When the service thread waits, and when it must not: in a harness whose transport tells how long it is
// asked to wait, with this thread in the service thread's place.
#include "service/core/service_loop.hpp"

#include "core_fixtures.hpp"

#include <functional>

namespace service_loop_test {
namespace {

using namespace harness;
using rowe::rt::duration;
using rowe::rt::monotonic_clock;
using rowe::rt::time_point;

// A waker that stays set until poll() takes it, as an edge-triggered eventfd. Never sleeps: wait() notes how
// long it would have.
class watched_transport : public rowe::net::memory_transport {
 public:
  using memory_transport::memory_transport;

  void poll(time_point now, rowe::service::transport_sink& sink) noexcept override {
    if (const auto doing = std::exchange(in_poll, nullptr)) doing();
    rung_ = false;
    memory_transport::poll(now, sink);
  }
  void wait(time_point now, time_point until) noexcept override {
    if (!rung_) longest = std::max(longest, until - now);
    if (const auto doing = std::exchange(in_wait, nullptr)) doing();
  }
  void wake() noexcept override { rung_ = true; }

  std::function<void()> in_poll; // another thread's doing, before poll() looks
  std::function<void()> in_wait;
  duration longest{};

 private:
  bool rung_ = false;
};

struct serving : testing::Test {
  core_harness_over<watched_transport> on{small_options(), rowe::service::side::server, 1,
                                          monotonic_clock::now()};
  rowe::service::service_loop loop{on.core, on.net, on.waker, rowe::idle::poll, 250us};
};

TEST_F(serving, ends_at_once_when_it_is_stopped_while_it_sleeps) {
  on.net.in_wait = [&] { loop.stop(monotonic_clock::now()); };
  loop.run(false);
  EXPECT_TRUE(loop.drained());
}

// The wake-up of stop() is taken by the cycle that runs: its poll() comes after the look whether to stop.
TEST_F(serving, does_not_sleep_when_it_is_stopped_in_the_middle_of_a_cycle) {
  on.net.in_poll = [&] { loop.stop(monotonic_clock::now()); };
  // A loop that sleeps all the same is stopped by this.
  on.net.in_wait = [&] { loop.stop(monotonic_clock::now()); };
  loop.run(false);
  EXPECT_LE(on.net.longest, 250us) << "of a wait that nothing would have ended";
  EXPECT_TRUE(loop.drained());
}

} // namespace
} // namespace service_loop_test
