// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/frame_group.hpp"

#include <cassert>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {

bool frame_group::add(peer_index peer, subscription_id only) noexcept {
  assert(!full());
  const connection& c = state_.peers[peer];
  peer_queues& queues = outbox_.of(peer);
  if (!c.open() || queues.blocked || queues.waits_to_begin || urgent_frames_.masks(peer)) return false;
  subscription& s = subscription_rows_[only];
  if (s.pending.count != 1 || (s.own_head && !s.whole) || s.throttle != rt::duration{0}) return false;
  if ((partial_frames_.of(peer) && !ROWE_MUTANT(group_partial)) ||
      (urgent_frames_.goes_first(peer) && !ROWE_MUTANT(group_urgent)) ||
      (urgent_frames_.room(peer, s.ready_as) == 0 && !ROWE_MUTANT(group_credit)))
    return false;
  const slot_ref slot = outbox_.entries().front(s.pending);
  if (s.whole && !message_store_.slots().whole(slot.index)) return false; // it has changed since
  if (message_store_.slots().chunked(slot.index)) return false;
  // As if the socket of each member took its frame in part only. A message to many is one slot.
  const bool another = count_ == 0 || members_[count_ - 1].piece.slot != slot.index;
  const std::uint32_t slots = ROWE_MUTANT(group_slots) ? 1 : slots_ + (another ? 1 : 0);
  if (message_store_.slots().lifetime(slot.index).carries_ttl && c.protocol->can.ttl_in_topics) return false;
  if (!message_store_.is_due(slot) || !partial_frames_.has_room_for(slot.index, slots)) return false;

  member& one = members_[count_];
  batch frame{{}, {&one.piece, 1}}; // a single frame is not copied
  const batch_piece of{.from = &s.pending, .subscription = only, .slot = slot.index};
  if (!message_frames_.add_shared(false, 0, frame, of)) return false;
  if (frame.bytes >= queues.group_bytes_max) return false; // a member counts as one unit of work
  ++count_;
  slots_ = slots;
  one.peer = peer;
  one.id = c.id;
  one.frame = frame.whole();
  queues.scheduled = true; // as in sender::flush()
  return true;
}

} // namespace rowe::service
