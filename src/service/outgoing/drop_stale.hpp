// SPDX-License-Identifier: Apache-2.0
// Drops what is over from the front of a subscription's queue: what has expired, and what was published
// longer ago than the lifespan that its peer asked for. Service thread only; nothing waits or allocates.
#pragma once
#include "service/outgoing/outbox.hpp"

namespace rowe::service {

inline void drop_stale(outbox& in, core_state& state, const slot_pool& slots, subscription& of) noexcept {
  in.drop_expired(of.pending);
  if (of.lifespan_ns == wire::unlimited) [[likely]]
    return;
  const rt::duration lifespan{of.lifespan_ns};
  for (; !of.pending.empty(); in.drop_expired(of.pending)) {
    const slot_id front = in.entries().front(of.pending).index;
    if (rt::deadline_after(slots.published(front), lifespan) >= state.cycle.now) return;
    state.counts.add(counter::expired);
    in.drop_front(of.pending);
  }
}

} // namespace rowe::service
