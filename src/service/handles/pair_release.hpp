// SPDX-License-Identifier: Apache-2.0
// Whether all slots of a queue pair whose handle is gone were released. Then its memory may be used for
// another pair. A view or an open request may outlive its handle by mistake, and the rings show it: each slot
// that the handle popped must have been released, and each slot that it took for an answer must have been
// pushed. After the handle has stored `closing` it pops and takes no more, and what it has parked stays
// parked.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>

namespace rowe::service {

// For the service thread, or a thread that has joined it, after it has seen `closing`. False may be out of
// date at once. True stays true, and all reads of the slots happen before it.
inline bool all_slots_released(detail::queue_pair& gone) noexcept {
  const auto released = [](const detail::producer_end& end, std::uint32_t parked) {
    if (end.ring == nullptr) return true; // a window has no slots to release
    const std::uint64_t popped = end.ring->popped();
    return end.free_ring->released() + parked == popped;
  };
  const detail::queue_pair::user_side& had = gone.user;
  if (!released(gone.service.in, 0) || !released(gone.service.completions, had.parked_completions.count))
    return false;
  if (gone.service.out.ring == nullptr) return true;
  return gone.service.out.ring->pushed() + had.spare_replies.count == had.out.free_ring->taken();
}

} // namespace rowe::service
