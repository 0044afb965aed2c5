// SPDX-License-Identifier: Apache-2.0
// The stop, as a loop sees it: from endpoint::stop_latch(), for one thread. A software stop, which
// complements a wired one and never replaces it. See docs/stop.md.
#pragma once
#include <utility>

#include <rowe/detail/queue_pair.hpp>

namespace rowe {

// Whether this loop may move. Stopped at start, and whenever a peer asks for it, a guard falls silent, any
// loop is late or the service thread is; from then on until a reset. Move-only; one thread at a time.
class stop_latch {
 public:
  stop_latch() noexcept = default; // empty: always engaged
  explicit stop_latch(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // True when the loop must not move: command the brake, then acknowledge(). To be asked once in each cycle:
  // asking is also how the loop shows that it is alive. `now` is the loop's time. Never waits, never
  // allocates, no system call: one load and one or two stores. True for ever once the endpoint is closed.
  ROWE_RT bool engaged(time_point now) noexcept {
    return !pair_ || detail::latch_engaged(*pair_->granted, pair_->latch, pair_->user.latch, now);
  }
  // The same with the time read here: one clock read more.
  ROWE_RT bool engaged() noexcept { return engaged(rt::monotonic_clock::now()); }

  // Says that the brake was commanded: who asked for the stop is told the time. rowe cannot know whether the
  // robot stands still. In each cycle that is engaged; calls but the first do nothing. Bounded as engaged().
  ROWE_RT void acknowledge(time_point now) noexcept {
    if (pair_) detail::latch_acknowledge(pair_->latch, pair_->user.latch, now);
  }
  ROWE_RT void acknowledge() noexcept { acknowledge(rt::monotonic_clock::now()); }

 private:
  detail::pair_handle pair_;
};

} // namespace rowe
