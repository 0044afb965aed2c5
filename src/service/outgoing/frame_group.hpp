// SPDX-License-Identifier: Apache-2.0
// Frames that are gathered for several peers before the first of them is written. A message to many peers is
// one frame for each. A call of the kernel needs more code and data than the first caches hold, so all that
// runs between two such calls is slow. Hence the sender hands these frames to the transport one straight
// after the other, and commits them behind all of them (decision 0032).
//
// Only a peer that gets one message, and nothing else, is a member. Service thread only; nothing waits or
// allocates.
#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <rowe/detail/mutation_points.hpp>
#include <span>
#include <utility>

#include "service/base/transport.hpp"
#include "service/outgoing/batch.hpp"
#include "service/outgoing/message_frames.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/outgoing/urgent_frames.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct frame_group_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  urgent_frames& urgent_frames_;
  partial_frames& partial_frames_;
  const message_frames& message_frames_;
};

class frame_group : frame_group_needs {
 public:
  explicit frame_group(const frame_group_needs& parts) noexcept
      : frame_group_needs{parts}, subscription_rows_{state_.subscriptions.all()} {}

  // A peer, its frame, and what the transport took of it.
  struct member {
    peer_index peer{};
    connection_id id{};
    batch_piece piece{};
    std::span<const std::byte> frame;
    std::size_t taken = 0;
  };

  std::uint32_t count() const noexcept { return count_; }
  bool full() const noexcept { return count_ == members_.size(); }
  // Gathers the message that waits for a peer, in the queue of this subscription, where it is the only one
  // that is ready; not when full. False: it has none or several, or something goes before it, or the frame
  // may not be begun. The peer counts as scheduled until its frame is committed. Nothing may be queued,
  // dropped or evicted before that.
  bool add(peer_index peer, subscription_id only) noexcept {
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
    if (message_store_.slots().lifetime(slot.index).carries_ttl && c.protocol->can.ttl_in_topics)
      return false;
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
  // All members. The group is empty then; they stay valid until the next add().
  std::span<member> take() noexcept {
    slots_ = 0;
    return std::span{members_}.first(std::exchange(count_, 0));
  }

 private:
  const rows<subscription_id, subscription> subscription_rows_;
  std::array<member, group_max> members_;
  std::uint32_t count_ = 0;
  std::uint32_t slots_ = 0; // of the members, each counted once where they stand side by side
};

} // namespace rowe::service
