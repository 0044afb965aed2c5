// SPDX-License-Identifier: Apache-2.0
// The messages that wait to be written to peers. A message is encoded once into a slot; each queue holds the
// slot's number.
//
// Each peer has a queue of replies and three queues of direct messages, one for each priority. Each of its
// subscriptions has a queue, too (subscription_queues.hpp). A peer with something to write is scheduled. The
// sender takes from there.
//
// When no slot or no entry is free, the peer that holds most of them makes room.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/index_ring.hpp"
#include "service/base/service_limits.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/state/core_state.hpp"
#include "service/state/peer_queues.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

class outbox {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  outbox(rt::arena& memory, core_state& state, message_store& store) noexcept;

  // ---- composition

  // As message_store::compose(). The peer that holds most makes room.
  template <class WriteText>
  slot_id compose(const message_lifetime& lifetime, WriteText&& write_text,
                  slot_use what = slot_use::ordinary) noexcept {
    const auto make_room = [this](slot_class of) { (void)evict_for(of); }; // compose() looks again
    return message_store_.compose(lifetime, write_text, what, make_room);
  }
  // The same for a topic's message; `write_body(json::writer&)` writes its body.
  template <class WriteBody>
  slot_id compose_message(topic_id topic, rt::time_point published, rt::time_point expires,
                          WriteBody&& write_body) noexcept;
  // Queues an answer to one peer. It is never thinned out, and expires only if it has a time to live. Returns
  // its slot; none: it was lost, counted, or the peer is closing. `by`: see announcement.hpp.
  template <class WriteText>
  slot_id reply(peer_index to, WriteText&& write_text, rt::time_point expires = rt::never,
                announcer by = announcer::none) noexcept {
    return reply_with(
        to, [&] { return compose(message_lifetime{expires}, write_text); }, by);
  }
  // The same with a slot that `compose()` returns, or none.
  template <class Compose>
  slot_id reply_with(peer_index to, Compose&& compose, announcer by = announcer::none) noexcept;
  // A reply that was written already. If it did not fit it is lost, and counted; an empty one is not sent.
  void reply_written(peer_index to, const json::writer& written, wire::message_kind kind) noexcept {
    if (written.overflowed()) return state_.counts.add(counter::outbox_full);
    if (kind == wire::message_kind::none || written.bytes() == 0) return;
    (void)reply(to, [&](json::writer& into) {
      into.append(written.text());
      return kind;
    });
  }
  // Whether the queue of replies takes one more.
  bool has_place_for_reply(peer_index to) noexcept {
    peer_queues& of = queues_[to];
    drop_expired(of.replies);
    return of.replies.count < (of.backpressured() ? replies_max_backpressured : replies_max);
  }

  // ---- queues

  // Whether a peer's queue of direct messages takes one more.
  bool has_room(peer_index to, priority at) noexcept {
    queue& direct = queues_[to].direct[static_cast<std::size_t>(at)];
    drop_expired(direct);
    return direct.count < state_.bounds().queue_depth_max && (!entries_.full() || entries_.any_evictable());
  }
  // Queues a direct message if there is room, with a reference of its own. False, counted: all entries are
  // taken after all.
  bool push_direct(peer_index to, priority at, slot_id slot) noexcept;

  // ---- eviction

  // Frees a slot of this class if it can: the peer that holds most loses its oldest message. False: nothing
  // can be evicted, or a bounded number of evictions freed none.
  bool evict_for(slot_class of) noexcept;
  // Drops all that is queued for a peer, except in its subscriptions.
  void forget(peer_index peer) noexcept;

  // ---- sender

  peer_queues& of(peer_index peer) noexcept { return queues_[peer]; }
  const peer_queues& of(peer_index peer) const noexcept { return queues_[peer]; }
  void open(peer_index peer) noexcept;
  // The peer has something to write. If the transport is full, on_writable() schedules it later.
  void schedule(peer_index peer) noexcept {
    peer_queues& c = queues_[peer];
    if (c.scheduled || c.blocked) return;
    c.scheduled = true;
    scheduled_.push(peer);
  }
  std::uint32_t scheduled() const noexcept { return scheduled_.count(); }
  peer_index take_scheduled() noexcept {
    const peer_index next = scheduled_.pop();
    queues_[next].scheduled = false;
    return next;
  }
  // The message in `slot` was gathered from this queue and goes to a socket. Its reference goes with it.
  void take_front(queue& from, slot_id slot) noexcept {
    // Entries in front of it have expired, and gathering skipped them.
    if (const slot_ref front = entries_.front(from); front.index != slot || !slots_.alive(front)) [[unlikely]]
      drop_expired(from);
    assert(entries_.front(from).index == slot);
    (void)entries_.pop(from); // its reference goes to the socket
  }

  // Gives a reference of the caller's to the queue. False: direct messages hold all entries, and those are
  // not evicted.
  bool enqueue(queue& to, slot_id slot) noexcept {
    if (entries_.full()) evict_entry();
    return entries_.push(to, slots_.ref(slot));
  }
  // Takes expired messages off the front of the queue.
  void drop_expired(queue& from) noexcept {
    while (!from.empty() && !message_store_.is_due(entries_.front(from)) && drop_expired_front(from)) {
    }
  }
  // Drops the message at the front.
  void drop_front(queue& from) noexcept { message_store_.release(entries_.pop(from).index); }
  // Drops all that is queued, and counts it.
  void drop_all(queue& from, counter as) noexcept;
  // How often a place in a queue or a slot became free.
  std::uint64_t room_changes() const noexcept { return entries_.popped() + slots_.freed(); }
  const queue_entries& entries() const noexcept { return entries_; }

  // ---- cycle

  // No message is queued, and no peer is scheduled.
  bool drained() const noexcept { return entries_.in_use() == 0 && scheduled_.empty(); }

  // The queues are as long as their counts say, and each peer is charged for what its queues hold. A slot has
  // one reference for each live entry and partial frame, and one if it is pinned.
  bool check() const noexcept;

 private:
  bool queue_reply(peer_index to, slot_id slot, announcer by) noexcept;
  bool drop_expired_front(queue& from) noexcept;
  bool drop_expired_behind(queue& from, entry_id before) noexcept;
  std::optional<entry_id> first_of(const queue& in, std::optional<slot_class> of) noexcept;
  peer_index holds_most(std::optional<slot_class> of) noexcept;
  void evict_entry() noexcept;
  void evict(peer_index from, std::optional<slot_class> of) noexcept;

  core_state& state_;
  message_store& message_store_;
  slot_pool& slots_;
  const rows<subscription_id, subscription> subscriptions_;
  queue_entries entries_;
  rows<peer_index, peer_queues> queues_;
  index_ring<peer_index> scheduled_;
};

template <class Compose>
slot_id outbox::reply_with(peer_index to, Compose&& compose, announcer by) noexcept {
  if (!state_.peers[to].open()) return {};
  const bool has_place = has_place_for_reply(to);
  if (!has_place) state_.counts.add(counter::outbox_full);
  const slot_id slot = has_place ? compose() : slot_id{};
  return slot && queue_reply(to, slot, by) ? slot : slot_id{};
}

template <class WriteBody>
slot_id outbox::compose_message(topic_id topic, rt::time_point published, rt::time_point expires,
                                WriteBody&& write_body) noexcept {
  std::size_t body_at = 0;
  std::size_t body_bytes = 0;
  const slot_id slot = compose(message_lifetime::of_topic(expires, state_.cycle.now), [&](json::writer& out) {
    out.append(state_.topics.head(topic));
    body_at = out.bytes();
    write_body(out);
    body_bytes = out.bytes() - body_at;
    for (const char& c : state_.topics.tail()) out.append({&c, 1}); // usually one character
  });
  if (slot) slots_.mark_body(slot, body_at, body_bytes, published);
  return slot;
}

} // namespace rowe::service
