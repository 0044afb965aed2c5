// SPDX-License-Identifier: Apache-2.0
// The stop, as a loop sees it: from endpoint::stop_latch(), for one thread. A software stop, which
// complements a wired one and never replaces it. See docs/stop.md.
#pragma once
#include <utility>

#include <rowe/detail/queue_pair.hpp>

namespace rowe {

// Says whether this loop may move. It is stopped at the start, and whenever a peer asks for it, a guard falls
// silent, or a loop or the service thread is late; then it stays stopped until a reset. Move-only; one thread
// at a time.
class stop_latch {
 public:
  stop_latch() noexcept = default; // empty: always engaged
  explicit stop_latch(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // True if the loop must not move: command the brake, then acknowledge(). Call it once in each cycle: the
  // call also shows that the loop is alive. `now` is the loop's time. Never waits, never allocates, no system
  // call: one load and one or two stores. True for ever after the endpoint was closed.
  ROWE_RT bool engaged(time_point now) noexcept {
    return !pair_ || detail::latch_engaged(*pair_->granted, pair_->latch, pair_->user.latch, now);
  }
  // The same; reads the time itself: one clock read more.
  ROWE_RT bool engaged() noexcept { return engaged(rt::monotonic_clock::now()); }

  // Says that the brake was commanded; the peers that asked for the stop are told the time. rowe cannot know
  // whether the robot stands still. Call it in each cycle that is engaged; all calls but the first do
  // nothing. Bounded as engaged().
  ROWE_RT void acknowledge(time_point now) noexcept {
    if (pair_) detail::latch_acknowledge(pair_->latch, pair_->user.latch, now);
  }
  ROWE_RT void acknowledge() noexcept { acknowledge(rt::monotonic_clock::now()); }

 private:
  detail::pair_handle pair_;
};

} // namespace rowe
