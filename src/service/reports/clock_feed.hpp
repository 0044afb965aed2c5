// SPDX-License-Identifier: Apache-2.0
// Tells the wall clock's time to peers whose protocol shows everything at their server's time, so that a
// robot's data lies right on a laptop with another clock. It is the clock by which their messages are
// stamped. A peer that does not read what it was told is told nothing more, since only the newest time means
// something. Service thread only; nothing waits or allocates.
#pragma once
#include <rowe/rt/clock.hpp>

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
  void show() noexcept;

 private:
  static bool has_clock(const connection& c) noexcept {
    return c.ours == side::server && c.protocol->can.clock && !c.stop_only;
  }

  rt::time_point all_told_at_{};
};

} // namespace rowe::service
