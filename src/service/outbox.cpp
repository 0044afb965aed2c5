// SPDX-License-Identifier: Apache-2.0
#include "service/outbox.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/check_sum.hpp"

namespace rowe::service {

namespace {

// Work, as the time to compose so many bytes: of one push to a queue, and of one eviction.
constexpr std::size_t push_work = 128;
constexpr std::size_t eviction_work = 1024;

} // namespace

std::size_t outbox::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return queue_entries::footprint_bytes(bounds) + arena::bytes_for<peer_queues>(bounds.connections_max) +
         arena::bytes_for<peer_index>(bounds.connections_max);
}

outbox::outbox(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : bounds_{bounds},
      cycle_{parts.cycle},
      counts_{parts.counts},
      due_{parts.due},
      store_{parts.store},
      slots_{parts.store.slots()},
      peers_{parts.peers},
      topics_{parts.topics},
      subscriptions_{parts.topics.subscriptions()},
      latches_{parts.latches},
      entries_{memory, bounds},
      queues_{memory.carve<peer_queues>(bounds.connections_max)},
      scheduled_{memory.carve<peer_index>(bounds.connections_max)} {}

void outbox::open(peer_index peer) noexcept {
  const bool scheduled = queues_[peer].scheduled; // the ring may still have its place from before
  queues_[peer] = {};
  queues_[peer].scheduled = scheduled;
  queues_[peer].replies.owner = queue_entries::owner_of(peer, queued_as::evictable);
  for (queue& direct : queues_[peer].direct)
    direct.owner = queue_entries::owner_of(peer, queued_as::direct_message);
}

slot_id outbox::compose_latched(topic_id topic_index) noexcept {
  topic& on = topics_.at(topic_index);
  if (!on.last.empty() && on.last.expires < cycle_.now) latches_.clear(on.last);
  if (on.last.empty()) return {};
  return compose_message(topic_index, on.last.published, on.last.expires,
                         [&](json::writer& into) { latches_.write(on.last, into); });
}

// ---- queueing

void outbox::fan_out(topic_id topic_index, slot_id slot) noexcept {
  const topic& on = topics_.at(topic_index);
  for (subscription_id i = on.first_subscription; i; i = subscriptions_[i].next_on_topic)
    if (accepts(subscriptions_[i])) push(i, slot);
}

// A value within the throttle period after the last one is discarded, unless the peer asked for a queue.
bool outbox::accepts(const subscription& s) noexcept {
  if (!s.discards || cycle_.now >= s.next_due) return true;
  add(counter::throttled);
  return false;
}

inline void outbox::push(subscription_id index, slot_id slot) noexcept {
  subscription& s = subscriptions_[index];
  cycle_.work_bytes += push_work;
  if (s.owes_last) place_latched(s);
  drop_expired(s.waiting);
  if (s.waiting.count >= s.depth) trim(s, s.depth - 1);
  if (!enqueue(s.waiting, slot)) return add(counter::outbox_full);
  slots_.retain(slot);
  make_ready(index);
}

// Drops the oldest messages of a subscription until it holds `most`.
void outbox::trim(subscription& s, std::uint32_t most) noexcept {
  for (drop_expired(s.waiting); s.waiting.count > most;
       ROWE_MUTANT(depth) ? void() : drop_expired(s.waiting)) {
    // The counter tells why: the peer wants only the newest, or fewer, or does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !queues_[s.peer].backpressured();
    add(s.merges || s.discards ? counter::replaced : chosen ? counter::throttled : counter::outbox_full);
    drop_front(s.waiting);
  }
}

void outbox::merge_requests(subscription_id index) noexcept {
  subscription& s = subscriptions_[index];
  topics_.merge(s, bounds_.queue_depth_max);
  if (!ROWE_MUTANT(depth)) trim(s, s.depth);
  if (ROWE_MUTANT(throttle)) return;
  s.next_due = s.sent_at == rt::time_point{} ? s.sent_at : rt::deadline_after(s.sent_at, s.throttle);
  if (std::exchange(s.timed, false)) due_.disarm(index);
  make_ready(index);
}

void outbox::owe_latched(subscription_id index) noexcept {
  subscription& s = subscriptions_[index];
  s.owes_last = true;
  ++queues_[s.peer].owed;
  make_ready(index);
}

void outbox::throttle_over(subscription_id index) noexcept {
  subscriptions_[index].timed = false;
  make_ready(index);
}

inline void outbox::put_on_ready_list(subscription_id index, subscription& s) noexcept {
  if (cycle_.now < s.next_due) {
    if (!std::exchange(s.timed, true)) due_.arm(index, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) due_.disarm(index);
  s.ready_as = topics_.at(s.topic).priority;
  s.ready = true;
  const peer_index peer = s.peer;
  queues_[peer].ready[static_cast<std::size_t>(s.ready_as)].push_back(subscriptions_, index);
  schedule(peer);
}

// Queues the latched value for a late subscriber, but only when it can be written. So a peer that subscribes
// to many topics at once does not take as many slots.
void outbox::place_latched(subscription& s) noexcept {
  s.owes_last = false;
  --queues_[s.peer].owed;
  const slot_id slot = compose_latched(s.topic);
  if (!slot) return;
  trim(s, s.depth - 1);
  if (enqueue(s.waiting, slot)) return; // the queue has the reference now
  add(counter::outbox_full);
  store_.release(slot);
}

void outbox::place_owed(peer_index peer) noexcept {
  const auto all = subscriptions_;
  for (const ready_list& on : queues_[peer].ready) {
    for (subscription_id i = on.head; i; i = all[i].next_ready) {
      if (all[i].owes_last) return place_latched(all[i]);
    }
  }
}

bool outbox::push_direct(peer_index to, priority at, slot_id slot) noexcept {
  if (!enqueue(queues_[to].direct[static_cast<std::size_t>(at)], slot)) {
    add(counter::outbox_full);
    return false;
  }
  slots_.retain(slot);
  schedule(to);
  return true;
}

// ---- taking

// The next message is due one period after this one was due; if that is long past, one period after now.
void outbox::begin_throttle(subscription& s) noexcept {
  const bool in_step = cycle_.now - s.next_due < s.throttle;
  s.sent_at = in_step ? s.next_due : cycle_.now;
  s.next_due = rt::deadline_after(s.sent_at, s.throttle);
}

void outbox::rotate_ready(peer_index peer) noexcept {
  for (ready_list& on : queues_[peer].ready) {
    if (on.empty()) continue;
    ready_list before = std::exchange(on, {});
    ready_list served;
    while (!before.empty()) {
      const subscription_id i = before.pop_front(subscriptions_);
      subscription& s = subscriptions_[i];
      drop_expired(s.waiting); // else it would stay ready with nothing to write, and schedule nobody
      // A served subscription goes behind the others only if it has more to write.
      if (s.served && !s.waiting.empty()) {
        served.push_back(subscriptions_, i);
      } else {
        s.ready = s.served = false;
        make_ready(i);
      }
    }
    while (!served.empty()) {
      const subscription_id i = served.pop_front(subscriptions_);
      subscriptions_[i].ready = subscriptions_[i].served = false;
      make_ready(i);
    }
  }
}

// ---- evicting and releasing

// Drops the message at the front if it is freed or expired. False: the queue is empty, or begins with a
// message that is to be sent.
bool outbox::drop_expired_front(queue& from) noexcept {
  if (from.empty()) return false;
  const slot_ref front = entries_.front(from);
  if (slots_.alive(front)) {
    if (slots_.expires(front.index) >= cycle_.now) return false;
    store_.expire(front.index); // in all queues at once, and counted
    if (slots_.alive(front)) {
      // Another peer's socket is in the middle of it, so only this queue drops it.
      add(counter::expired);
      store_.release(front.index);
    }
  }
  (void)entries_.pop(from); // the reference is released already
  return true;
}

void outbox::drop_all(queue& from, counter as) noexcept {
  while (!from.empty()) {
    if (drop_expired_front(from)) continue;
    add(as);
    drop_front(from);
  }
}

void outbox::drop(subscription_id index) noexcept {
  subscription& s = subscriptions_[index];
  peer_queues& its_peer = queues_[s.peer];
  drop_all(s.waiting, counter::lost_with_peer);
  if (std::exchange(s.owes_last, false)) --its_peer.owed;
  if (std::exchange(s.timed, false)) due_.disarm(index);
  if (std::exchange(s.ready, false)) {
    [[maybe_unused]] const bool was =
        its_peer.ready[static_cast<std::size_t>(s.ready_as)].erase(subscriptions_, {index});
    assert(was);
  }
}

void outbox::forget(peer_index peer) noexcept {
  drop_all(queues_[peer].replies, counter::lost_with_peer);
  for (queue& direct : queues_[peer].direct) drop_all(direct, counter::lost_with_peer);
}

// Evicts message after message of the peer that holds most, until a slot is free. So a peer that holds less
// loses nothing because slots ran out ("longest queue drop": Suter, Lakshman, Stiliadis and Choudhury, IEEE
// INFOCOM 1998).
bool outbox::evict_for(slot_class of) noexcept {
  constexpr unsigned evictions_max = 64;
  for (unsigned left = evictions_max; left != 0; --left) {
    const peer_index most = holds_most(of);
    if (!most || (ROWE_MUTANT(hoarder) && !queues_[most].backpressured())) return false;
    evict({most}, of);
    if (slots_.free_for_all(of) != 0) return true;
  }
  return false;
}

// A peer that holds more than an equal share; of several that hold as much, a backpressured one.
peer_index outbox::holds_most(std::optional<slot_class> of) noexcept {
  const std::uint32_t all = of ? slots_.count(*of) : bounds_.queued_max;
  return entries_.longest(of, all / std::max(peers_.count(), 1U),
                          [this](peer_index i) { return queues_[i].backpressured(); });
}

// As evict_for(), for an entry of a queue.
void outbox::evict_entry() noexcept {
  const peer_index most = holds_most(std::nullopt);
  if (most) evict(most, std::nullopt);
}

// Evicts the oldest message of the longest queue of a peer; first of the queues whose front is a slot of the
// class, if there are any. The peer has something queued.
void outbox::evict(peer_index from, std::optional<slot_class> of) noexcept {
  cycle_.work_bytes += eviction_work;
  peer_queues& its = queues_[from];
  queue* longest = nullptr;
  topic_id topic{};
  bool fits = false;
  const auto look_at = [&](queue& one, topic_id its_topic) {
    if (one.empty()) return;
    const bool this_fits = !of || slots_.class_of(entries_.front(one).index) == *of;
    if (longest != nullptr && (fits > this_fits || (fits == this_fits && longest->count >= one.count)))
      return;
    longest = &one;
    topic = its_topic;
    fits = this_fits;
  };
  look_at(its.replies, {});
  for (subscription_id i = topics_.first_subscription(from); i; i = subscriptions_[i].next_on_peer)
    look_at(subscriptions_[i].waiting, subscriptions_[i].topic);
  assert(longest != nullptr);
  if (drop_expired_front(*longest)) return;
  const slot_ref oldest = entries_.front(*longest);
  store_.note_evicted(oldest.index); // it may be a reply whose sender waits for the outcome
  add(its.backpressured() ? counter::outbox_full : counter::evicted);
  if (slots_.needed(oldest.index) && peers_[from].open()) peers_.close_later(peers_[from], unread_sentence);
  drop_front(*longest);
  if (!topic) return;
  // Other subscribers lose this message, too, if they are backpressured or hold more than an equal share.
  // They usually queue the same slots, and a slot is free only when no queue has it.
  const slot_class size = slots_.class_of(oldest.index);
  const std::uint32_t share = slots_.count(size) / std::max(peers_.count(), 1U);
  for (subscription_id i = topics_.at(topic).first_subscription; i && slots_.alive(oldest);
       i = subscriptions_[i].next_on_topic) {
    subscription& same = subscriptions_[i];
    const bool reads = !queues_[same.peer].backpressured();
    const auto may_lose_it = [&] {
      return !reads || entries_.held_by(same.peer, queued_as::evictable, size) > share;
    };
    if (same.waiting.empty() || entries_.front(same.waiting) != oldest || !may_lose_it()) continue;
    add(reads ? counter::evicted : counter::outbox_full);
    drop_front(same.waiting);
  }
}

// ---- for tests

bool outbox::check() const noexcept {
  std::uint32_t left = entries_.in_use();
  std::uint64_t queued = 0;
  std::uint32_t scheduled = 0;
  std::array<std::array<std::uint32_t, 2>, 2> held{}; // of one peer: by kind of queue, and by size class
  const auto fits = [&](const queue& one) {
    std::uint32_t length = 0;
    entry_id last{};
    for (entry_id at = one.entries.head; at; last = at, at = entries_.after(at)) {
      const slot_ref slot = entries_.at(at);
      if (left == 0 || slot.index.value >= slots_.count()) return false;
      if (slots_.alive(slot)) queued += weight(slot.index);
      --left;
      ++length;
      ++held[one.owner % 2][static_cast<std::size_t>(slots_.class_of(slot.index))];
    }
    return length == one.count && one.entries.tail == last;
  };
  const auto charged = [&](peer_index peer) {
    for (const queued_as what : {queued_as::evictable, queued_as::direct_message}) {
      for (const slot_class size : {slot_class::small, slot_class::large}) {
        if (entries_.held_by(peer, what, size) !=
            held[static_cast<std::size_t>(what)][static_cast<std::size_t>(size)])
          return false;
      }
    }
    return true;
  };
  for (const peer_index i : peers_.ids()) {
    const connection& c = peers_[i];
    const peer_queues& of = queues_[i];
    held = {};
    scheduled += of.scheduled;
    if (c.state == connection::phase::free) {
      if (!charged(i)) return false;
      continue;
    }
    if (!fits(of.replies) || !std::all_of(of.direct.begin(), of.direct.end(), fits)) return false;
    std::uint32_t ready = 0;
    std::uint32_t owed = 0;
    for (subscription_id s = topics_.first_subscription(i); s; s = subscriptions_[s].next_on_peer) {
      const subscription& one = subscriptions_[s];
      const bool on_wheel = one.timed && one.next_due != rt::never; // one never due is not on the wheel
      if (!fits(one.waiting) || on_wheel != due_.armed(s)) return false;
      ready += one.ready;
      owed += one.owes_last;
    }
    for (const ready_list& on : of.ready) {
      for (subscription_id s = on.head; s && ready != UINT32_MAX; s = subscriptions_[s].next_ready) {
        const subscription& one = subscriptions_[s];
        if (one.peer != i || !one.ready || &of.ready[static_cast<std::size_t>(one.ready_as)] != &on)
          return false;
        --ready;
      }
    }
    if (ready != 0 || owed != of.owed || !charged(i)) return false;
  }
  std::uint64_t references = 0;
  std::uint64_t others = 0;
  for (const slot_id i : slots_.ids()) {
    const bool in_use = slots_.references(i) != 0;
    references += weight(i) * slots_.references(i);
    others += weight(i) * slots_.begun(i) + (in_use && slots_.kept(i) ? weight(i) : 0);
  }
  return left == 0 && scheduled == scheduled_.count() && references == queued + others;
}

} // namespace rowe::service
