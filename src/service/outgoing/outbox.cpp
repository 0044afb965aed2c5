// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/outbox.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/check_sum.hpp"
#include "service/base/shares.hpp"

namespace rowe::service {

std::size_t outbox::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return queue_entries::footprint_bytes(bounds) + arena::bytes_for<peer_queues>(bounds.connections_max) +
         arena::bytes_for<peer_index>(bounds.connections_max);
}

outbox::outbox(rt::arena& memory, core_state& state, message_store& store) noexcept
    : state_{state},
      message_store_{store},
      slots_{store.slots()},
      subscriptions_{state_.subscriptions.all()},
      entries_{memory, state_.bounds()},
      queues_{memory.carve<peer_queues>(state_.bounds().connections_max)},
      scheduled_{memory.carve<peer_index>(state_.bounds().connections_max)} {}

void outbox::open(peer_index peer) noexcept {
  const bool scheduled = queues_[peer].scheduled; // the ring may still have its place from before
  queues_[peer] = {};
  queues_[peer].scheduled = scheduled;
  queues_[peer].replies.owner = queue_entries::owner_of(peer, queued_as::evictable);
  queues_[peer].long_replies.owner = queues_[peer].replies.owner;
  for (queue& direct : queues_[peer].direct)
    direct.owner = queue_entries::owner_of(peer, queued_as::direct_message);
}

bool outbox::queue_reply(peer_index to, slot_id slot, announcer by) noexcept {
  if (!enqueue(slots_.chunked(slot) ? queues_[to].long_replies : queues_[to].replies, slot)) {
    message_store_.release(slot);
    state_.counts.add(counter::outbox_full);
    return false;
  }
  slots_.set_announcer(slot, by);
  queues_[to].lost.begin(by);
  schedule(to);
  return true;
}

bool outbox::push_direct(peer_index to, priority at, slot_id slot) noexcept {
  if (!enqueue(queues_[to].direct[static_cast<std::size_t>(at)], slot)) {
    state_.counts.add(counter::outbox_full);
    return false;
  }
  slots_.retain(slot);
  schedule(to);
  return true;
}

// ---- eviction and release

// Drops the message at the front if it is freed or expired. False: the queue is empty, or begins with a
// message that is to be sent.
bool outbox::drop_expired_front(queue& from) noexcept {
  return !from.empty() && drop_expired_behind(from, {});
}

// The same for the message behind an entry; behind none it is the front.
bool outbox::drop_expired_behind(queue& from, entry_id before) noexcept {
  const slot_ref front = entries_.behind(from, before);
  if (slots_.alive(front)) {
    if (slots_.expires(front.index) >= state_.cycle.now) return false;
    message_store_.expire(front.index); // in all queues at once, and counted
    if (slots_.alive(front)) {
      // Another peer's socket has taken a part of it, so only this queue drops it.
      state_.counts.add(counter::expired);
      message_store_.release(front.index);
    }
  }
  (void)entries_.take_behind(from, before); // the reference is released already
  return true;
}

void outbox::drop_all(queue& from, counter as) noexcept {
  while (!from.empty()) {
    if (drop_expired_front(from)) continue;
    state_.counts.add(as);
    drop_front(from);
  }
}

void outbox::forget(peer_index peer) noexcept {
  drop_all(queues_[peer].replies, counter::lost_with_peer);
  drop_all(queues_[peer].long_replies, counter::lost_with_peer);
  for (queue& direct : queues_[peer].direct) drop_all(direct, counter::lost_with_peer);
  entries_.forget(peer);
}

// Evicts messages of the peer that holds most, until a slot is free ("longest queue drop": Suter, Lakshman,
// Stiliadis and Choudhury, IEEE INFOCOM 1998). Direct messages are not evicted.
bool outbox::evict_for(slot_class of) noexcept {
  for (unsigned left = evictions_max; left != 0; --left) {
    const peer_index most = holds_most(of);
    if (!most || (ROWE_MUTANT(hoarder) && !queues_[most].backpressured())) return false;
    // A reply to who reads is written in this cycle. One that is evicted is missed in silence.
    if (!queues_[most].backpressured() && entries_.is_all(queues_[most].replies, of)) return false;
    if (evict({most}, of); slots_.free_for_all(of) != 0) return true;
  }
  return false;
}

// The peer found last, while it holds more than an equal share; else who holds most, slow readers first.
peer_index outbox::holds_most(std::optional<slot_class> of) noexcept {
  const std::uint32_t all = of ? slots_.count(*of) : state_.bounds().queued_max;
  return entries_.longest(of, equal_share(all, state_.peers.count()),
                          [this](peer_index i) { return queues_[i].reads_slowly(); });
}

// As evict_for(), for an entry of a queue.
void outbox::evict_entry() noexcept {
  if (const peer_index most = holds_most(std::nullopt)) evict(most, std::nullopt);
}

// Evicts the oldest message of the class in the peer's longest queue that has one: also out of its middle, or
// many others would be lost for it. The peer must have something of the class queued.
void outbox::evict(peer_index from, std::optional<slot_class> of) noexcept {
  state_.cycle.work_bytes += eviction_work;
  peer_queues& its = queues_[from];
  queue* longest = nullptr;
  topic_id topic{};
  entry_id before{}; // the entry in front of it
  const auto look_at = [&](queue& one, topic_id its_topic) {
    if (longest != nullptr && longest->count >= one.count) return;
    const auto found = first_of(one, of);
    if (!found) return;
    longest = &one;
    topic = its_topic;
    before = *found;
  };
  // Of replies only the front: an announcement counts how many have left (announcement.hpp).
  if (!its.replies.empty() && (!of || slots_.class_of(entries_.front(its.replies).index) == *of))
    longest = &its.replies;
  look_at(its.long_replies, {});
  for (subscription_id i = state_.subscriptions.first_of(from); i; i = subscriptions_[i].next_on_peer)
    look_at(subscriptions_[i].pending, subscriptions_[i].topic);
  if (longest == nullptr) longest = &its.replies; // it stands behind others there
  if (drop_expired_behind(*longest, before)) return;
  const slot_ref oldest = entries_.behind(*longest, before);
  message_store_.note_evicted(oldest.index); // it may be a reply whose sender waits for the outcome
  state_.counts.add(its.backpressured() ? counter::outbox_full : counter::evicted);
  its.lost.note(slots_.announcer_of(oldest.index));
  message_store_.release(entries_.take_behind(*longest, before).index);
  if (!topic) return;
  ++its.dropped;
  // Other subscribers lose this message, too, if they are backpressured or hold more than an equal share.
  // They usually queue the same slots, and a slot is free only when no queue has it.
  const slot_class size = slots_.class_of(oldest.index);
  const std::uint32_t share = equal_share(slots_.count(size), state_.peers.count());
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i && slots_.alive(oldest);
       i = subscriptions_[i].next_on_topic) {
    subscription& same = subscriptions_[i];
    const bool reads = !queues_[same.peer].backpressured();
    const auto found = first_of(same.pending, size);
    if (!found || entries_.behind(same.pending, *found) != oldest) continue;
    if (reads && entries_.held_by(same.peer, queued_as::evictable, size) <= share) continue;
    state_.counts.add(reads ? counter::evicted : counter::outbox_full);
    ++queues_[same.peer].dropped;
    message_store_.release(entries_.take_behind(same.pending, *found).index);
  }
}

// The oldest message of a class, or of any, in a queue: the entry in front of it, or nothing.
std::optional<entry_id> outbox::first_of(const queue& in, std::optional<slot_class> of) noexcept {
  std::size_t passed = 0;
  entry_id before{};
  for (entry_id at = in.entries.head; at; before = at, at = entries_.after(at), ++passed) {
    if (of && slots_.class_of(entries_.at(at).index) != *of) continue;
    state_.cycle.work_bytes += passed * eviction_pass_work;
    return before;
  }
  state_.cycle.work_bytes += passed * eviction_pass_work;
  return std::nullopt;
}

// ---- checks

bool outbox::check() const noexcept {
  std::uint32_t left = entries_.in_use();
  std::uint64_t queued = 0;
  std::uint32_t scheduled = 0;
  std::array<by_class<std::uint32_t>, 2> held{}; // of one peer: by kind of queue
  const auto fits = [&](const queue& one) {
    std::uint32_t length = 0;
    entry_id last{};
    for (entry_id at = one.entries.head; at; last = at, at = entries_.after(at)) {
      const slot_ref slot = entries_.at(at);
      if (left == 0 || slot.index.value >= slots_.count()) return false;
      if (slots_.alive(slot)) queued += weight(slot.index);
      --left;
      ++length;
      ++held[one.owner % 2][index_of(slots_.class_of(slot.index))];
    }
    return length == one.count && one.entries.tail == last;
  };
  const auto charged = [&](peer_index peer) {
    for (const queued_as what : {queued_as::evictable, queued_as::direct_message}) {
      for (const slot_class size : {slot_class::small, slot_class::large, slot_class::chunked}) {
        if (entries_.held_by(peer, what, size) != held[static_cast<std::size_t>(what)][index_of(size)])
          return false;
      }
    }
    return true;
  };
  for (const peer_index i : state_.peers.ids()) {
    const connection& c = state_.peers[i];
    const peer_queues& of = queues_[i];
    held = {};
    scheduled += of.scheduled;
    if (c.state == connection::phase::free) {
      if (!charged(i)) return false;
      continue;
    }
    if (!fits(of.replies) || !fits(of.long_replies) || !std::all_of(of.direct.begin(), of.direct.end(), fits))
      return false;
    for (subscription_id s = state_.subscriptions.first_of(i); s; s = subscriptions_[s].next_on_peer) {
      if (!fits(subscriptions_[s].pending)) return false;
    }
    if (!charged(i)) return false;
  }
  std::uint64_t references = 0;
  std::uint64_t others = 0;
  for (const slot_id i : slots_.ids()) {
    const bool in_use = slots_.references(i) != 0;
    references += weight(i) * slots_.references(i);
    others += weight(i) * slots_.partial(i) + (in_use && slots_.pinned(i) ? weight(i) : 0);
  }
  return left == 0 && scheduled == scheduled_.count() && references == queued + others;
}

} // namespace rowe::service
