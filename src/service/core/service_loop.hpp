// SPDX-License-Identifier: Apache-2.0
// The service thread: it runs cycles of the core, and waits between them. Only it reads the clock, and passes
// the time to the core. One loop runs on one thread; stop() is for other threads.
#pragma once
#include <algorithm>
#include <cstdint>

#include <rowe/options.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/waker.hpp>

#include "service/base/transport.hpp"
#include "service/core/core.hpp"

namespace rowe::service {

// When a SCHED_FIFO thread that never sleeps should yield its core. The kernel throttles such a thread: once
// it has used its share of a second (950 ms by default), it loses the core for the rest (50 ms). So the
// thread yields by itself, 8 % of the time, each time for far less than that. To yield it waits for sockets.
// Under a flood each such wait ends at once; then the thread sleeps instead. The share was measured:
// docs/decisions/0016-yield-the-core-for-eight-percent.md.
class throttle_avoidance {
 public:
  static constexpr rt::duration yield_time = std::chrono::microseconds{100};
  // The part of each yield that the kernel needs to switch threads.
  static constexpr rt::duration call_cost = std::chrono::microseconds{15};

  // The thread has been awake until `now`.
  void awake_until(rt::time_point now) noexcept {
    if (since_ != rt::time_point{}) owed_ += (now - since_) * 8 / 92;
    owed_ = std::min(owed_, 8 * yield_time);
    since_ = now;
  }
  // Since then it has waited for sockets; or it has slept.
  void waited_until(rt::time_point now) noexcept {
    pay(now);
    in_vain_ = owed_ >= yield_time;
  }
  void slept_until(rt::time_point now) noexcept {
    pay(now);
    in_vain_ = false;
  }
  // Whether to wait now. After a wait that ended too early, the thread must sleep before it waits again. A
  // peer that answers each message at once ends every wait, so each wait would cost its next message a
  // wake-up.
  bool due() const noexcept { return owed_ >= yield_time && !in_vain_; }
  // Whether to sleep now: waiting was not enough.
  bool overdue() const noexcept { return owed_ >= 2 * yield_time; }

 private:
  void pay(rt::time_point now) noexcept {
    owed_ = std::max(owed_ - std::max(now - since_ - call_cost, rt::duration{0}), rt::duration{0});
    since_ = now;
  }

  rt::time_point since_{};
  rt::duration owed_{};
  bool in_vain_ = false;
};

class service_loop {
 public:
  // Handles wake the thread by `waker`, under idle::wake.
  service_loop(core& does, transport& sockets, rt::waker<>& waker, idle policy,
               rt::duration poll_period) noexcept
      : core_{does}, transport_{sockets}, waker_{waker}, policy_{policy}, poll_period_{poll_period} {}

  // Runs until stop(). `fifo`: the thread was granted SCHED_FIFO. Service thread.
  void run(bool fifo) noexcept;

  // Any other thread, once: everything published so far has until `drain_until` to be written. Then peers are
  // sent a close frame, and run() returns. Enters the kernel.
  void stop(rt::time_point drain_until) noexcept;

  // After run() has returned: whether all was written.
  bool drained() const noexcept { return drained_; }

 private:
  void cycle() noexcept;
  void await_answer() noexcept;
  void idle_until(rt::time_point next, bool fifo) noexcept;
  void close_peers() noexcept;

  core& core_;
  transport& transport_;
  rt::waker<>& waker_;
  const idle policy_;
  const rt::duration poll_period_;
  throttle_avoidance throttle_;
  rt::time_point now_{}; // read after each cycle and each wait, and nowhere else
  rt::time_point next_{};
  rt::std_atomics::variable<std::int64_t> drain_until_ns_{rt::nanoseconds_of(rt::never)};
  bool drained_ = false;
};

} // namespace rowe::service
