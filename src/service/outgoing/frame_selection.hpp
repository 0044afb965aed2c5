// SPDX-License-Identifier: Apache-2.0
// Which frames are written to a peer next, and how many: the rest of a partial frame, then urgent frames,
// then messages by their priority, as far as the batch and the peer's credit take them. The subscriptions of
// one priority take turns. In the middle of a long message, its next fragment is the only message. A
// message in fragments that are texts goes behind urgent messages, and takes turns with others. Service
// thread only; nothing waits or allocates.
#pragma once
#include <cstddef>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/counters.hpp"
#include "service/outgoing/batch.hpp"
#include "service/outgoing/drop_stale.hpp"
#include "service/outgoing/mask_keys.hpp"
#include "service/outgoing/message_frames.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/outgoing/urgent_frames.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

// The peer that is written to, looked up once.
struct recipient {
  peer_index index;
  connection& peer;
  peer_queues& queues;
  bool masked;
};

struct frame_selection_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  mask_keys& mask_keys_;
  urgent_frames& urgent_frames_;
  partial_frames& partial_frames_;
  const message_frames& message_frames_;
};

class frame_selection : frame_selection_needs {
 public:
  explicit frame_selection(const frame_selection_needs& parts) noexcept
      : frame_selection_needs{parts},
        subscription_rows_{state_.subscriptions.all()},
        slots_{message_store_.slots()} {}

  // Adds what is written first: a partial frame, then urgent frames. False: no message may follow.
  bool add_urgent(const recipient& to, batch& into) noexcept {
    return add_partial(to, into) &&
           urgent_frames_.gather(to.index, to.peer.open(), partial_frames_.of(to.index), into);
  }
  // Then messages, by their priority.
  void add_messages(const recipient& to, batch& into) noexcept;
  // Adds the rest of a partial frame. Nothing may go before it. False: nothing may follow, either.
  bool add_partial(const recipient& to, batch& into) noexcept {
    partial_frame& frame = partial_frames_.of(to.index);
    return !frame.mid_frame() || add_rest(to, frame, into);
  }

  // Adds all that is left of the message that is under way, as far as the batch takes it, whatever the
  // credit. False: there is nothing, or it is under way as usual.
  bool add_all_left(const recipient& to, batch& into) noexcept;

 private:
  bool add_rest(const recipient& to, partial_frame& frame, batch& into) noexcept;
  void add_diverted(const recipient& to, partial_frame& frame, batch& into) noexcept;
  void add_next_fragment(const recipient& to, partial_frame& frame, batch& into) noexcept;
  bool add_texts(const recipient& to, partial_frame& frame, batch& into, std::size_t credit,
                 std::size_t bytes) noexcept;
  bool add_others(const recipient& to, std::size_t at, const queue* but, batch& into) noexcept;
  enum class beginning : std::uint8_t { whole, begun, waits };
  beginning begin_in_frames(const recipient& to, batch& into, const batch_piece& piece) noexcept;
  bool add_queue(const recipient& to, queue& from, subscription_id of, batch& into) noexcept;

  const rows<subscription_id, subscription> subscription_rows_;
  const slot_pool& slots_;
};

inline void frame_selection::add_messages(const recipient& to, batch& into) noexcept {
  peer_queues& from = to.queues;
  if (partial_frame& begun = partial_frames_.of(to.index); begun.diverts()) [[unlikely]]
    return add_diverted(to, begun, into);
  // A server must know of a topic before anything is published on it.
  const priority replies_at = to.peer.ours == side::client ? priority::urgent : priority::normal;
  for (std::size_t p = 0; p < from.ready.size(); ++p) {
    const bool replies = p == static_cast<std::size_t>(replies_at) && from.any_replies();
    if (!replies && from.direct[p].empty() && from.ready[p].empty()) continue;
    into.credit = urgent_frames_.room(to.index, static_cast<priority>(p));
    if (replies && !(add_queue(to, from.replies, {}, into) && add_queue(to, from.long_replies, {}, into)))
      return;
    if (!from.direct[p].empty() && !add_queue(to, from.direct[p], {}, into)) return;
    for (subscription_id i = from.ready[p].head; i; i = subscription_rows_[i].next_ready) {
      if (!add_queue(to, subscription_rows_[i].pending, i, into)) return;
    }
  }
}

inline bool frame_selection::add_rest(const recipient& to, partial_frame& frame, batch& into) noexcept {
  const batch_piece piece{
      .slot = frame.slot, .key = frame.key, .is = batch_piece::origin::partial, .own_head = frame.own_head};
  if (frame.in_frames()) [[unlikely]]
    return message_frames_.add_fragment(to.masked, frame, into, piece);
  if (frame.own_head) return message_frames_.add_headed(to.masked, frame.written, into, piece, frame.head);
  return message_frames_.add_shared(to.masked, frame.written, into, piece);
}

// Gathers as much of a queue as the batch takes; one message, if the subscription is throttled. False: the
// batch is full, or the peer's credit is used up. One byte of credit is enough to begin a frame of any
// length.
inline bool frame_selection::add_queue(const recipient& to, queue& from, subscription_id of,
                                       batch& into) noexcept {
  of ? drop_stale(outbox_, state_, slots_, subscription_rows_[of]) : outbox_.drop_expired(from);
  const bool one = of && subscription_rows_[of].throttle > rt::duration{0};
  const bool own_head = of && subscription_rows_[of].own_head;
  const wire::capabilities& can = to.peer.protocol->can;
  const bool writes_ttl = of ? can.ttl_in_topics || ROWE_MUTANT(ttl_to_all) : can.ttl_in_messages;
  const queue_entries& entries = outbox_.entries();
  for (entry_id at = from.entries.head; at; at = entries.after(at)) {
    const slot_ref slot = entries.at(at);
    if (!message_store_.is_due(slot)) continue; // dropped when it comes to the front
    if ((into.full() || into.bytes >= into.credit) && !urgent_frames_.may_go_on(to.index, into)) return false;
    if (!partial_frames_.may_begin(to.index, slot.index)) break;
    batch_piece piece{.from = &from,
                      .subscription = of,
                      .slot = slot.index,
                      .is = batch_piece::origin::message,
                      .own_head = own_head && !slots_.whole(slot.index)};
    if (writes_ttl && slots_.lifetime(slot.index).carries_ttl) [[unlikely]] {
      const rt::duration left = message_frames_.left_of(slot.index, into);
      if (left < wire::ttl_unit) {
        into.more = true; // it is over, but not yet in this cycle: the next one drops it
        return false;
      }
      piece.own_head = true;
      piece.ttl_ns = left.count();
    }
    if (to.masked) piece.key = mask_keys_.next();
    if (slots_.chunked(slot.index) || slots_.message_bytes(slot.index) > to.queues.whole_bytes_max)
        [[unlikely]] {
      const beginning made = begin_in_frames(to, into, piece);
      if (made != beginning::whole) return made == beginning::waits;
    }
    const bool fits =
        piece.own_head ? message_frames_.add_headed(to.masked, 0, into, piece, message_frames_.head_of(piece))
                       : message_frames_.add_shared(to.masked, 0, into, piece);
    if (!fits) {
      into.more = true;
      return false;
    }
    if (one) break;
  }
  return true;
}

} // namespace rowe::service
