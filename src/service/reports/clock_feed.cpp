// SPDX-License-Identifier: Apache-2.0
#include "service/reports/clock_feed.hpp"

#include <algorithm>
#include <cstdint>

#include "service/base/service_limits.hpp"

namespace rowe::service {

void clock_feed::show() noexcept {
  const std::int64_t wall_ns = rt::nanoseconds_of(state_.cycle.now) + state_.options.wall_offset_ns;
  const bool all = state_.cycle.now - all_told_at_ >= idle_clock_period;
  if (all) all_told_at_ = state_.cycle.now;
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

} // namespace rowe::service
