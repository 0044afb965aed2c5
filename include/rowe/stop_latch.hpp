// SPDX-License-Identifier: Apache-2.0
// The stop, as a loop sees it: from endpoint::stop_latch(), for one thread. A software stop, which
// complements a wired one and never replaces it. See docs/stop.md.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/detail/queue_pair.hpp>

namespace rowe {

// How long a loop and the service thread may be silent before the loops stop, and why so long.
struct stop_times {
  enum class reason : std::uint8_t { option, real_time_priority, ordinary_priority };

  duration loop_timeout = {};
  reason loop = reason::option; // the priority of the thread that opened the latch
  duration service_timeout = {};
  reason service = reason::option; // the priority of the service thread

  // A buffer of so many bytes holds the longest text().
  static constexpr std::size_t text_bytes_max = 200;
  // "loop_timeout 500 ms (a thread without real-time priority), service_timeout 50 ms (a thread of real-time
  // priority)": written into `buffer` and cut where it ends; returns the part written. Any thread, never
  // allocates.
  std::string_view text(std::span<char> buffer) const noexcept;
};

// Says whether this loop may move. It is stopped at the start, and whenever a peer asks for it, a guard falls
// silent, or a loop or the service thread is late; then it stays stopped until a reset. Move-only; one thread
// at a time.
class stop_latch {
 public:
  stop_latch() noexcept = default; // empty: always engaged
  explicit stop_latch(detail::pair_handle pair, const stop_times& times = {}) noexcept
      : pair_{std::move(pair)}, times_{times} {}

  // True if the loop must not move: command the brake, then acknowledge(). Call it once in each cycle: the
  // call also shows that the loop is alive, and how regularly it runs (`loops` of /rowe/stats). `now` is the
  // loop's time. Never waits, never allocates, no system call; bounded. True for ever after the endpoint was
  // closed.
  ROWE_RT bool engaged(time_point now) noexcept {
    if (!pair_) return true;
    pair_->timing->note(pair_->latch.checked_in(), now);
    return detail::latch_engaged(*pair_->granted, pair_->latch, pair_->user.latch, now);
  }
  // The same; reads the time itself: one clock read more.
  ROWE_RT bool engaged() noexcept { return engaged(rt::monotonic_clock::now()); }

  // Reports that the brake was commanded. The peers that asked for the stop get the time. rowe cannot know
  // whether the robot stands still. Call it in each cycle that is engaged; all calls but the first do
  // nothing. Bounded as engaged().
  ROWE_RT void acknowledge(time_point now) noexcept {
    if (pair_) detail::latch_acknowledge(pair_->latch, pair_->user.latch, now);
  }
  ROWE_RT void acknowledge() noexcept { acknowledge(rt::monotonic_clock::now()); }

  // When the loops of this endpoint stop by themselves, for this one's sake or the service thread's. Any
  // thread.
  const stop_times& times() const noexcept { return times_; }

 private:
  detail::pair_handle pair_;
  stop_times times_{};
};

} // namespace rowe
