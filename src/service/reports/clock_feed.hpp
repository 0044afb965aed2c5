// SPDX-License-Identifier: Apache-2.0
// Sends the wall clock's time to peers whose protocol shows everything at their server's time, so that a
// robot's data lies right on a laptop with another clock. It is the clock by which their messages are
// stamped. A peer that has not read the last time gets no other, since only the newest time means something.
// Service thread only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/protocols/protocols.hpp"

namespace rowe::service {

struct clock_feed_needs {
  core_state& state_;
  outbox& outbox_;
};

class clock_feed : clock_feed_needs {
 public:
  explicit clock_feed(const clock_feed_needs& parts) noexcept : clock_feed_needs{parts} {}

  // A peer has come.
  void open(const connection& c) noexcept {
    if (has_clock(c)) state_.due.arm(timer::clock, state_.cycle.now);
  }
  // Its timer is due. Without such peers it is armed again by the next one that comes.
  void show() noexcept {
    const std::int64_t wall_ns = rt::nanoseconds_of(state_.cycle.now) + state_.options.wall_offset_ns;
    const bool all = state_.cycle.now - sent_to_all_at_ >= idle_clock_period;
    if (all) sent_to_all_at_ = state_.cycle.now;
    rt::duration next = rt::for_ever;
    for (const connection& c : state_.peers) {
      if (!c.open() || !has_clock(c)) continue;
      const peer_index peer{c.id.index};
      const bool looks_on = static_cast<bool>(state_.subscriptions.first_of(peer));
      next = std::min(next, looks_on ? clock_period : idle_clock_period);
      if ((!looks_on && !all) || !outbox_.of(peer).replies.empty()) continue;
      // Its slot is not needed: nobody tracks it.
      (void)outbox_.reply(peer,
                          [&](json::writer& into) { return c.protocol->topics.write_time(into, wall_ns); });
    }
    if (next != rt::for_ever) state_.due.arm(timer::clock, state_.cycle.now + next);
  }

 private:
  static bool has_clock(const connection& c) noexcept {
    return c.ours == side::server && c.protocol->can.clock && !c.stop_only;
  }

  rt::time_point sent_to_all_at_{};
};

} // namespace rowe::service
