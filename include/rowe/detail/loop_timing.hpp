// SPDX-License-Identifier: Apache-2.0
// How regularly a loop runs: the times from one look at its latch to the next, since the latch was opened.
// Written by the loop's thread alone; the service thread reads it for its reports, and neither waits for the
// other (rt::histogram). It lies in the memory of the latch's queue pair.
#pragma once
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/histogram.hpp>

namespace rowe::detail {

class loop_timing {
 public:
  // The loop's thread looks at `now`, and looked at `before`; zero: never. A time that does not rise counts
  // as no time. Never waits, never allocates; bounded: two cache lines, no loop.
  ROWE_RT void note(rt::time_point before, rt::time_point now) noexcept {
    if (before != rt::time_point{}) cycles_.record(now - before);
  }
  // Any thread.
  const rt::histogram& cycles() const noexcept { return cycles_; }

 private:
  // An error of at most 1/128, 0.8 %: 4 us of a loop of 1 kHz. The counters take 30 KiB, which are whole
  // lines.
  rt::inline_histogram<7> cycles_;
};

} // namespace rowe::detail
