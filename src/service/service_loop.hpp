// SPDX-License-Identifier: Apache-2.0
// The service thread: cycles of the core, and how it waits between them. It reads the clock, which the core
// does not; everything else about time is the core's. One loop runs on one thread; stop() is for others.
#pragma once
#include <algorithm>
#include <cstdint>

#include <rowe/options.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/wake_bell.hpp>

#include "service/core.hpp"
#include "service/transport.hpp"

namespace rowe::service {

// Naps of a thread that may not run on for ever. A SCHED_FIFO thread that does is taken off its core by the
// kernel for the rest of each second once it has used its share (950 ms by default: a gap of 50 ms), so it
// gives up the core by itself: 8 % of the time, in naps far shorter than that gap. A nap is a wait for
// sockets, as long as something comes of it; under a flood, when each such wait ends at once, the thread
// sleeps. The share was measured: docs/decisions/0016-yield-the-core-for-eight-percent.md.
class nap_budget {
 public:
  static constexpr rt::duration nap = std::chrono::microseconds{100};
  // What the kernel needs of each to leave the core and come back: no rest for others.
  static constexpr rt::duration call_cost = std::chrono::microseconds{15};

  // It has been awake until `now`.
  void awake_until(rt::time_point now) noexcept {
    if (since_ != rt::time_point{}) owed_ += (now - since_) * 8 / 92;
    owed_ = std::min(owed_, 8 * nap);
    since_ = now;
  }
  // And has waited since then; or slept.
  void waited_until(rt::time_point now) noexcept {
    pay(now);
    in_vain_ = owed_ >= nap;
  }
  void slept_until(rt::time_point now) noexcept {
    pay(now);
    in_vain_ = false;
  }
  // Time to wait. Not again when that was in vain, until it has slept: whoever sends a message as soon as the
  // last one is answered ends every wait, and each would cost his next message a wake-up.
  bool due() const noexcept { return owed_ >= nap && !in_vain_; }
  bool overdue() const noexcept { return owed_ >= 2 * nap; } // waiting did not help

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
  // `bell` is what handles ring, under idle::wake.
  service_loop(core& does, transport& sockets, rt::wake_bell<>& bell, idle policy,
               rt::duration poll_period) noexcept
      : core_{does}, transport_{sockets}, bell_{bell}, policy_{policy}, poll_period_{poll_period} {}

  // Runs until stop(). `fifo`: the thread was granted SCHED_FIFO. Service thread.
  void run(bool fifo) noexcept;

  // Any other thread, once: everything published so far has until `drain_until` to be written, then peers are
  // told goodbye and run() returns. Enters the kernel.
  void stop(rt::time_point drain_until) noexcept;

  // After run() has returned: whether all was written.
  bool drained() const noexcept { return drained_; }

 private:
  void cycle() noexcept;
  void await_answer() noexcept;
  void idle_until(rt::time_point next, bool fifo) noexcept;
  void say_goodbye() noexcept;

  core& core_;
  transport& transport_;
  rt::wake_bell<>& bell_;
  const idle policy_;
  const rt::duration poll_period_;
  nap_budget naps_;
  rt::time_point now_{}; // read behind each cycle and each wait, and nowhere else
  rt::time_point next_{};
  rt::std_atomics::variable<std::int64_t> drain_until_ns_{rt::nanoseconds_of(rt::never)};
  bool drained_ = false;
};

} // namespace rowe::service
