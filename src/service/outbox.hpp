// SPDX-License-Identifier: Apache-2.0
// What waits to be written to peers. A message is encoded once into a slot; each queue holds the slot's
// number.
//
// Each peer has a queue of replies, three of direct messages (one a priority), and its subscriptions have one
// each. A subscription that may be written now is on the ready list of its peer and priority; a peer with
// something to write is scheduled. The sender takes from there.
//
// Where all slots or all entries are taken, the peer that holds most of them makes room.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/index_list.hpp"
#include "service/index_ring.hpp"
#include "service/latch_store.hpp"
#include "service/message_store.hpp"
#include "service/peer_table.hpp"
#include "service/queues.hpp"
#include "service/router.hpp"
#include "service/timers.hpp"
#include "service/wire_slots.hpp"
#include "json/writer.hpp"

namespace rowe::service {

// The subscriptions of one peer and priority that have something to write, served in turn.
using ready_list = index_queue<subscription_id, subscription, &subscription::next_ready>;

// What waits for one peer.
struct peer_queues {
  queue replies;               // answers to its own requests
  std::array<queue, 3> direct; // messages to it, by priority
  std::array<ready_list, 3> ready;
  std::uint32_t owed = 0;      // subscriptions whose latched value is still to be queued
  bool scheduled = false;      // among those with something to write
  bool blocked = false;        // the transport has no room; on_writable() comes
  bool held = false;           // its credit has none for what is not urgent; a pong comes
  bool told_full = false;      // senders are told `full`: it has its share of what waits
  bool waits_to_begin = false; // others keep it from beginning its next frame

  // It reads more slowly than we would write, or waits for others who do.
  bool backpressured() const noexcept { return blocked || held || waits_to_begin; }
};

class outbox {
 public:
  struct needs {
    cycle_state& cycle;
    counters& counts;
    timers& due;
    message_store& store;
    peer_table& peers;
    router& topics;
    latch_store& latches;
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  outbox(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  // ---- composing

  // message_store::compose(); the peer that holds most makes room.
  template <class WriteText>
  std::uint32_t compose(rt::time_point expires, WriteText&& write_text,
                        slot_use what = slot_use::ordinary) noexcept {
    const auto make_room = [this](slot_class of) { (void)evict_for(of); }; // whether it did is seen
    return store_.compose(expires, write_text, what, make_room);
  }
  // The message of a topic whose body `write_body(json::writer&)` writes, as compose() does.
  template <class WriteBody>
  std::uint32_t compose_message(std::uint32_t topic, rt::time_point expires, WriteBody&& write_body) noexcept;
  // The latched value of a topic; no_index where there is none, or no slot, which is counted.
  std::uint32_t compose_latched(std::uint32_t topic) noexcept;
  // To one peer, an answer: never thinned out, and dropped as late only where it has a time of its own.
  // Returns its slot; no_index when it is lost, counted.
  template <class WriteText>
  std::uint32_t reply(peer_index to, WriteText&& write_text, rt::time_point expires = rt::never) noexcept;
  // Whether reply() would find a place.
  bool has_place_for_reply(peer_index to) noexcept {
    peer_queues& of = queues_[to];
    drop_expired(of.replies);
    return of.replies.count < (of.backpressured() ? replies_max_backpressured : replies_max);
  }
  // Replies that a peer has not read yet. Of one that reads more slowly than it is written to fewer: a few
  // that ask and do not read must not take the slots of all.
  static constexpr std::uint32_t replies_max = 64;
  static constexpr std::uint32_t replies_max_backpressured = 16;

  // ---- queueing

  // A message to everyone who subscribes to a topic; takes no reference of the caller's.
  void fan_out(std::uint32_t topic, std::uint32_t slot) noexcept;
  // What a peer asked of a subscription has changed: depth, throttle, or how often its topic is kept.
  void merge_requests(std::uint32_t subscription) noexcept;
  // A new subscriber of a topic with a latched value is to be given that.
  void owe_latched(std::uint32_t subscription) noexcept;
  // The throttle of a subscription allows its next message.
  void throttle_over(std::uint32_t subscription) noexcept;
  // Whether a peer's queue of direct messages takes one more.
  bool has_room(peer_index to, priority at) noexcept {
    queue& direct = queues_[to].direct[static_cast<std::size_t>(at)];
    drop_expired(direct);
    return direct.count < bounds_.queue_depth_max && (!entries_.full() || entries_.any_evictable());
  }
  // A direct message, with a reference of its own, where there is room. False, counted, when all entries are
  // taken after all.
  bool push_direct(peer_index to, priority at, std::uint32_t slot) noexcept;

  // ---- giving back

  // Frees a slot of `of` where it can: a peer that has more than an equal share of them queued loses its
  // oldest. False when there is nothing to evict, or when so many evictions freed none.
  bool evict_for(slot_class of) noexcept;
  // All that waits in a subscription; it is not ready any more.
  void drop(std::uint32_t subscription) noexcept;
  // All that waits for a peer, but in its subscriptions.
  void forget(peer_index peer) noexcept;

  // ---- for the sender

  peer_queues& of(peer_index peer) noexcept { return queues_[peer]; }
  const peer_queues& of(peer_index peer) const noexcept { return queues_[peer]; }
  void open(peer_index peer) noexcept;
  // It has something to write; where the transport is full, it is looked at when there is room again.
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
  // The latched value of one of the ready subscriptions that wait for theirs.
  void place_owed(peer_index peer) noexcept;
  // The message in `slot`, which was gathered from this queue, goes to a socket, with its reference. `of`:
  // the subscription; none for a queue of the peer's own.
  void take_front(queue& from, std::uint32_t slot, std::uint32_t of) noexcept {
    // What stands in front of it was passed over when it was gathered, for its time is over.
    if (const slot_ref front = entries_.front(from); front.index != slot || !slots_.alive(front)) [[unlikely]]
      drop_expired(from);
    assert(entries_.front(from).index == slot);
    (void)entries_.pop(from); // its reference goes to the socket
    if (of == no_index) return;
    subscription& s = subscriptions_[subscription_id{of}];
    s.served = true;
    if (s.throttle != rt::duration{0}) [[unlikely]]
      begin_throttle(s);
  }
  // Takes subscriptions off the ready lists that have nothing to write now, and puts those that were served
  // behind those that were not, so that they take turns.
  void rotate_ready(peer_index peer) noexcept;

  // Takes out what is over at the front.
  void drop_expired(queue& from) noexcept {
    while (!from.empty() && !store_.is_due(entries_.front(from)) && drop_expired_front(from)) continue;
  }
  // How often a place in a queue or a slot became free.
  std::uint64_t room_changes() const noexcept { return entries_.popped() + slots_.freed(); }
  const queue_entries& entries() const noexcept { return entries_; }

  // ---- of the cycle

  // Nothing waits.
  bool drained() const noexcept { return entries_.in_use() == 0 && scheduled_.empty(); }

  // Queues are as long as they say, and peers are charged for what theirs hold. Each slot has as many
  // references as there are live entries, partial frames, and one where it is kept. A subscription is ready
  // where it is on a list, and timed where it is armed.
  bool check() const noexcept;

 private:
  void add(counter which, std::uint64_t by = 1) noexcept { counts_.add(which, by); }
  bool accepts(const subscription& s) noexcept;
  void push(std::uint32_t subscription, std::uint32_t slot) noexcept;
  // The queue gets a reference of the caller's. False when all entries are taken by direct messages, which
  // are not evicted.
  bool enqueue(queue& to, std::uint32_t slot) noexcept {
    if (entries_.full()) evict_entry();
    return entries_.push(to, slots_.ref(slot));
  }
  void trim(subscription& s, std::uint32_t most) noexcept;
  void place_latched(subscription& s) noexcept;
  // Where it has something that may be written now, and is not ready already.
  void make_ready(std::uint32_t index) noexcept {
    subscription& s = subscriptions_[subscription_id{index}];
    if (!s.ready && (!s.waiting.empty() || s.owes_last)) put_on_ready_list(index, s);
  }
  void put_on_ready_list(std::uint32_t index, subscription& s) noexcept;
  void begin_throttle(subscription& s) noexcept;
  bool drop_expired_front(queue& from) noexcept;
  void drop_front(queue& from) noexcept { store_.release(entries_.pop(from).index); }
  void drop_all(queue& from, counter as) noexcept;
  std::uint32_t holds_most(std::optional<slot_class> of) noexcept;
  void evict_entry() noexcept;
  void evict(peer_index from, std::optional<slot_class> of) noexcept;

  const limits bounds_;
  cycle_state& cycle_;
  counters& counts_;
  timers& due_;
  message_store& store_;
  wire_slots& slots_;
  peer_table& peers_;
  router& topics_;
  const rows<subscription_id, subscription> subscriptions_;
  latch_store& latches_;
  queue_entries entries_;
  rows<peer_index, peer_queues> queues_;
  index_ring<peer_index> scheduled_;
};

template <class WriteText>
std::uint32_t outbox::reply(peer_index to, WriteText&& write_text, rt::time_point expires) noexcept {
  if (!peers_[to].open()) return no_index;
  const bool has_place = has_place_for_reply(to);
  const std::uint32_t slot = has_place ? compose(expires, write_text) : no_index;
  if (!has_place) add(counter::outbox_full);
  if (slot == no_index) return no_index;
  if (enqueue(queues_[to].replies, slot)) {
    schedule(to);
    return slot;
  }
  store_.release(slot);
  add(counter::outbox_full);
  return no_index;
}

template <class WriteBody>
std::uint32_t outbox::compose_message(std::uint32_t topic, rt::time_point expires,
                                      WriteBody&& write_body) noexcept {
  std::size_t body_at = 0;
  std::size_t body_bytes = 0;
  const std::uint32_t slot = compose(expires, [&](json::writer& text) {
    text.append(topics_.head(topic));
    body_at = text.bytes();
    write_body(text);
    body_bytes = text.bytes() - body_at;
    for (const char& c : topics_.tail()) text.append({&c, 1}); // as a rule one
  });
  if (slot != no_index) slots_.mark_body(slot, body_at, body_bytes);
  return slot;
}

} // namespace rowe::service
