// SPDX-License-Identifier: Apache-2.0
// A loop with a period. Deadlines are absolute and lie on a grid that never moves, so neither late wake-ups
// nor long cycles add up; a loop that is late by whole periods skips them and counts them. wait() hands out
// the one time that the cycle works with: everything else that needs `now` takes it as an argument.
//
//   rowe::rt::periodic loop{1ms, {.cpu = 2, .priority = 80}};
//   while (auto now = loop.wait()) { ... }
//
// One thread constructs the loop and waits in it; stop() and the counters are for everyone.
#pragma once
#include <atomic>
#include <cassert>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/grants.hpp>
#include <rowe/rt/histogram.hpp>

namespace rowe::rt {

struct periodic_options {
  std::optional<int> cpu = {}; // as in thread_options, applied to the thread that constructs the loop
  int priority = 0;
  std::uint64_t cycles_max = 0; // wait() returns nothing after so many cycles; 0: no such end
  std::string_view name = {};
};

// Time as the kernel gives it: CLOCK_MONOTONIC, and waiting by clock_nanosleep.
struct kernel_clock {
  static time_point now() noexcept { return monotonic_clock::now(); }
  // Waits. May return early, when a signal was delivered to the thread.
  static void sleep_until(time_point deadline) noexcept;
};

// `Clock` has now() and sleep_until(deadline), as kernel_clock does.
template <class Clock>
class basic_periodic {
 public:
  // Applies cpu, priority and name to the calling thread (see prepare_this_thread); grants() says what came
  // of it. `period` is positive. The grid begins with the first wait(), not here: set-up may follow.
  explicit basic_periodic(duration period, const periodic_options& options = {}, Clock clock = {}) noexcept
      : clock_{std::move(clock)},
        period_{period > duration::zero() ? period : duration{1}},
        cycles_max_{options.cycles_max},
        grants_{
            prepare_this_thread({.name = options.name, .cpu = options.cpu, .priority = options.priority})} {
    assert(period > duration::zero());
  }
  basic_periodic(const basic_periodic&) = delete;
  basic_periodic& operator=(const basic_periodic&) = delete;

  // Waits for the next deadline and returns the time then, read once; the first call returns at once. Nothing
  // after stop(), which is seen at the latest one period after it was called (at once where a signal
  // interrupts the wait), or after `cycles_max` cycles. Enters the kernel; never allocates.
  [[nodiscard]] std::optional<time_point> wait() noexcept;

  // Ends the loop. Any thread, or a signal handler.
  ROWE_RT void stop() noexcept {
    stopped_.store(true, std::memory_order_release); // release: pairs with acquire in stopped()
  }
  ROWE_RT bool stopped() const noexcept {
    return stopped_.load(std::memory_order_acquire); // acquire: pairs with release in stop()
  }

  // Any thread; never waits. Cycles are counted as they begin; overruns are the periods that were skipped
  // because the loop was late.
  ROWE_RT duration period() const noexcept { return period_; }
  ROWE_RT std::uint64_t cycles() const noexcept { return cycles_.get(); }
  ROWE_RT std::uint64_t overruns() const noexcept { return overruns_.get(); }
  // When the next cycle is due; `never` before the first wait().
  ROWE_RT time_point next_deadline() const noexcept {
    return time_point{duration{static_cast<std::int64_t>(next_.get())}};
  }
  // How late the cycles began, against the deadline each of them waited for: wake-ups, and the loop's own
  // overruns.
  ROWE_RT const histogram& lateness() const noexcept { return lateness_; }
  ROWE_RT const rt::grants& grants() const noexcept { return grants_; }
  ROWE_RT Clock& clock() noexcept { return clock_; }

 private:
  void set_next(time_point deadline) noexcept {
    next_.set(static_cast<std::uint64_t>(nanoseconds_of(deadline)));
  }

  Clock clock_;
  const duration period_;
  const std::uint64_t cycles_max_;
  counter cycles_, overruns_;
  counter next_{static_cast<std::uint64_t>(nanoseconds_of(never))};
  std_atomics::variable<bool> stopped_{false};
  inline_histogram<> lateness_;
  rt::grants grants_;
};

using periodic = basic_periodic<kernel_clock>;

template <class Clock>
std::optional<time_point> basic_periodic<Clock>::wait() noexcept {
  if (stopped() || (cycles_max_ != 0 && cycles() >= cycles_max_)) return std::nullopt;
  time_point deadline = next_deadline();
  time_point now;
  if (deadline == never) { // the first cycle: the grid begins here
    deadline = now = clock_.now();
  } else {
    do { // again only when a signal cut the wait short
      clock_.sleep_until(deadline);
      if (stopped()) return std::nullopt;
      now = clock_.now();
    } while (now < deadline);
    lateness_.record(now - deadline);
    const auto missed = (now - deadline) / period_;
    overruns_.add(static_cast<std::uint64_t>(missed));
    deadline += missed * period_;
  }
  set_next(deadline + period_);
  cycles_.add();
  return now;
}

extern template class basic_periodic<kernel_clock>;

} // namespace rowe::rt
