// SPDX-License-Identifier: Apache-2.0
// The service thread: cycles of the core, and how it waits between them. It reads the clock, which the core
// does not; everything else about time is the core's. One loop runs on one thread; stop() is for others.
#pragma once
#include <cstdint>

#include <rowe/options.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/wake_bell.hpp>

#include "service/core.hpp"
#include "service/transport.hpp"

namespace rowe::service {

// Naps of a thread that otherwise never sleeps. A SCHED_FIFO thread that runs on without a pause is taken off
// its core by the kernel for the rest of each second once it has used its share (950 ms by default: a gap of
// 50 ms), so it gives up the core by itself: 6 % of the time, in naps far shorter than that gap.
class nap_budget {
 public:
  static constexpr rt::duration nap_max = std::chrono::microseconds{100};
  static constexpr rt::duration busy_max = nap_max * 94 / 6; // between two naps

  // How long to nap now; 0: not yet.
  rt::duration due(rt::time_point now) const noexcept {
    return now - awake_since_ >= busy_max ? nap_max : rt::duration{0};
  }
  // What came of it: a nap that an event cut short buys less busy time.
  void napped(rt::time_point from, rt::time_point to) noexcept {
    const rt::duration slept = to - from;
    awake_since_ = slept >= nap_max ? to : to - (busy_max - slept * 94 / 6);
  }

 private:
  rt::time_point awake_since_{};
};

class service_loop {
 public:
  // `bell` is what handles ring, under idle::wake.
  service_loop(core& does, transport& carrier, rt::wake_bell<>& bell, idle policy,
               rt::duration poll_period) noexcept
      : core_{does}, carrier_{carrier}, bell_{bell}, policy_{policy}, poll_period_{poll_period} {}

  // Runs until stop(). `fifo`: the thread was granted SCHED_FIFO. Service thread.
  void run(bool fifo) noexcept;

  // Any other thread, once: everything published so far has until `drain_until` to be written, then peers are
  // told goodbye and run() returns. Enters the kernel.
  void stop(rt::time_point drain_until) noexcept;

  // After run() has returned: whether all was written.
  bool drained() const noexcept { return drained_; }

 private:
  void cycle() noexcept;
  void idle_until(rt::time_point next, bool fifo) noexcept;
  void say_goodbye() noexcept;

  core& core_;
  transport& carrier_;
  rt::wake_bell<>& bell_;
  const idle policy_;
  const rt::duration poll_period_;
  nap_budget naps_;
  rt::time_point next_{};
  rt::std_atomics::variable<std::int64_t> drain_until_ns_{rt::nanoseconds_of(rt::never)};
  bool drained_ = false;
};

} // namespace rowe::service
