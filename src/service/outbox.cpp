// SPDX-License-Identifier: Apache-2.0
#include "service/outbox.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/check_sum.hpp"

namespace rowe::service {

namespace {

// As much work as to compose so many bytes: one place in a queue, and one taken from whoever holds most.
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
  queues_[peer].replies.owner = queue_entries::owner_of(peer.value, queued_as::evictable);
  for (queue& direct : queues_[peer].direct)
    direct.owner = queue_entries::owner_of(peer.value, queued_as::direct_message);
}

std::uint32_t outbox::compose_latched(std::uint32_t topic_index) noexcept {
  topic& on = topics_.at(topic_index);
  if (!on.last.empty() && on.last.expires < cycle_.now) latches_.clear(on.last);
  if (on.last.empty()) return no_index;
  return compose_message(topic_index, on.last.expires,
                         [&](json::writer& into) { latches_.write(on.last, into); });
}

// ---- queueing

void outbox::fan_out(std::uint32_t topic_index, std::uint32_t slot) noexcept {
  const topic& on = topics_.at(topic_index);
  for (std::uint32_t i = on.first_subscription; i != no_index;
       i = subscriptions_[subscription_id{i}].next_on_topic) {
    if (accepts(subscriptions_[subscription_id{i}])) push(i, slot);
  }
}

// What comes within the throttle's period of the last one written is discarded, unless the peer asked for a
// queue.
bool outbox::accepts(const subscription& s) noexcept {
  if (!s.discards || cycle_.now >= s.next_due) return true;
  add(counter::throttled);
  return false;
}

inline void outbox::push(std::uint32_t index, std::uint32_t slot) noexcept {
  subscription& s = subscriptions_[subscription_id{index}];
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
    // Why it goes: the peer wants the newest only, or less often, or does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !queues_[peer_index{s.connection}].backpressured();
    add(s.merges || s.discards ? counter::replaced : chosen ? counter::throttled : counter::outbox_full);
    drop_front(s.waiting);
  }
}

void outbox::merge_requests(std::uint32_t index) noexcept {
  subscription& s = subscriptions_[subscription_id{index}];
  topics_.merge(s, bounds_.queue_depth_max);
  if (!ROWE_MUTANT(depth)) trim(s, s.depth);
  if (ROWE_MUTANT(throttle)) return;
  s.next_due = s.sent_at == rt::time_point{} ? s.sent_at : rt::deadline_after(s.sent_at, s.throttle);
  if (std::exchange(s.timed, false)) due_.disarm(subscription_id{index});
  make_ready(index);
}

void outbox::owe_latched(std::uint32_t index) noexcept {
  subscription& s = subscriptions_[subscription_id{index}];
  s.owes_last = true;
  ++queues_[peer_index{s.connection}].owed;
  make_ready(index);
}

void outbox::throttle_over(std::uint32_t index) noexcept {
  subscriptions_[subscription_id{index}].timed = false;
  make_ready(index);
}

inline void outbox::put_on_ready_list(std::uint32_t index, subscription& s) noexcept {
  if (cycle_.now < s.next_due) {
    if (!std::exchange(s.timed, true)) due_.arm(subscription_id{index}, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) due_.disarm(subscription_id{index});
  s.ready_as = topics_.at(s.topic).priority;
  s.ready = true;
  const peer_index peer{s.connection};
  queues_[peer].ready[static_cast<std::size_t>(s.ready_as)].push_back(subscriptions_, {index});
  schedule(peer);
}

// Queues the latched value for one who came late; not before it can be written, so that one who subscribes to
// many topics at once does not take as many slots.
void outbox::place_latched(subscription& s) noexcept {
  s.owes_last = false;
  --queues_[peer_index{s.connection}].owed;
  const std::uint32_t slot = compose_latched(s.topic);
  if (slot == no_index) return;
  trim(s, s.depth - 1);
  if (enqueue(s.waiting, slot)) return; // with its reference
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

bool outbox::push_direct(peer_index to, priority at, std::uint32_t slot) noexcept {
  if (!enqueue(queues_[to].direct[static_cast<std::size_t>(at)], slot)) {
    add(counter::outbox_full);
    return false;
  }
  slots_.retain(slot);
  schedule(to);
  return true;
}

// ---- taking

// The next one is due a period after this one was, or after now if that is long past.
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
      drop_expired(s.waiting); // else one with nothing to write would stay ready, and schedule nobody
      // Of those that were served, who has nothing left has no turn to wait for.
      if (s.served && !s.waiting.empty()) {
        served.push_back(subscriptions_, i);
      } else {
        s.ready = s.served = false;
        make_ready(i.value);
      }
    }
    while (!served.empty()) {
      const subscription_id i = served.pop_front(subscriptions_);
      subscriptions_[i].ready = subscriptions_[i].served = false;
      make_ready(i.value);
    }
  }
}

// ---- giving back

// Drops the message at the front if it is gone or its time is. False when the queue begins with one to be
// sent.
bool outbox::drop_expired_front(queue& from) noexcept {
  if (from.empty()) return false;
  const slot_ref front = entries_.front(from);
  if (slots_.alive(front)) {
    if (slots_.expires(front.index) >= cycle_.now) return false;
    store_.expire(front.index); // for all queues at once, and counted
    if (slots_.alive(front)) {
      // Another peer's socket is in the middle of it, so it goes for this peer alone.
      add(counter::expired);
      store_.release(front.index);
    }
  }
  (void)entries_.pop(from); // the reference is given back already
  return true;
}

void outbox::drop_all(queue& from, counter as) noexcept {
  while (!from.empty()) {
    if (drop_expired_front(from)) continue;
    add(as);
    drop_front(from);
  }
}

void outbox::drop(std::uint32_t index) noexcept {
  subscription& s = subscriptions_[subscription_id{index}];
  peer_queues& its_peer = queues_[peer_index{s.connection}];
  drop_all(s.waiting, counter::lost_with_peer);
  if (std::exchange(s.owes_last, false)) --its_peer.owed;
  if (std::exchange(s.timed, false)) due_.disarm(subscription_id{index});
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

// One message after the other of those who hold most goes, as long as others hold the same: so nobody who
// holds less loses anything for want of slots ("longest queue drop": Suter, Lakshman, Stiliadis and
// Choudhury, IEEE INFOCOM 1998).
bool outbox::evict_for(slot_class of) noexcept {
  constexpr unsigned evictions_max = 64;
  for (unsigned left = evictions_max; left != 0; --left) {
    const std::uint32_t most = holds_most(of);
    if (most == no_index || (ROWE_MUTANT(hoarder) && !queues_[peer_index{most}].backpressured()))
      return false;
    evict({most}, of);
    if (slots_.free_for_all(of) != 0) return true;
  }
  return false;
}

// Who has more than an equal share; of several that hold as much, one that does not read.
std::uint32_t outbox::holds_most(std::optional<slot_class> of) noexcept {
  const std::uint32_t all = of ? slots_.count(*of) : bounds_.queued_max;
  return entries_.longest(of, all / std::max(peers_.count(), 1U),
                          [this](std::uint32_t i) { return queues_[peer_index{i}].backpressured(); });
}

// The same for the entries of queues.
void outbox::evict_entry() noexcept {
  const std::uint32_t most = holds_most(std::nullopt);
  if (most != no_index) evict({most}, std::nullopt);
}

// Takes the oldest message out of the longest queue of a peer, of those that begin with a slot of the class
// if there is one. The peer has something queued.
void outbox::evict(peer_index from, std::optional<slot_class> of) noexcept {
  cycle_.work_bytes += eviction_work;
  peer_queues& its = queues_[from];
  queue* longest = nullptr;
  std::uint32_t topic = no_index;
  bool fits = false;
  const auto look_at = [&](queue& one, std::uint32_t its_topic) {
    if (one.empty()) return;
    const bool this_fits = !of || slots_.class_of(entries_.front(one).index) == *of;
    if (longest != nullptr && (fits > this_fits || (fits == this_fits && longest->count >= one.count)))
      return;
    longest = &one;
    topic = its_topic;
    fits = this_fits;
  };
  look_at(its.replies, no_index);
  for (std::uint32_t i = peers_[from].first_subscription; i != no_index;
       i = subscriptions_[subscription_id{i}].next_on_connection) {
    look_at(subscriptions_[subscription_id{i}].waiting, subscriptions_[subscription_id{i}].topic);
  }
  assert(longest != nullptr);
  if (drop_expired_front(*longest)) return;
  const slot_ref oldest = entries_.front(*longest);
  store_.note_evicted(oldest.index); // perhaps a reply that is waited for
  add(its.backpressured() ? counter::outbox_full : counter::evicted);
  drop_front(*longest);
  if (topic == no_index) return;
  // Those who do not read, and those who hold more than an equal share, lose it, too: as a rule they hold
  // what the first one holds, and the slot is free only when nobody does.
  const slot_class size = slots_.class_of(oldest.index);
  const std::uint32_t share = slots_.count(size) / std::max(peers_.count(), 1U);
  for (std::uint32_t i = topics_.at(topic).first_subscription; i != no_index && slots_.alive(oldest);
       i = subscriptions_[subscription_id{i}].next_on_topic) {
    subscription& same = subscriptions_[subscription_id{i}];
    const bool reads = !queues_[peer_index{same.connection}].backpressured();
    const auto may_lose_it = [&] {
      return !reads || entries_.held_by(same.connection, queued_as::evictable, size) > share;
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
  std::array<std::array<std::uint32_t, 2>, 2> held{}; // of one peer: how it queues, size class
  const auto fits = [&](const queue& one) {
    std::uint32_t length = 0;
    entry_id last{};
    for (entry_id at = one.entries.head; at; last = at, at = entries_.after(at)) {
      const slot_ref slot = entries_.at(at);
      if (left == 0 || slot.index >= slots_.count()) return false;
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
        if (entries_.held_by(peer.value, what, size) !=
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
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = subscriptions_[subscription_id{s}].next_on_connection) {
      const subscription& one = subscriptions_[subscription_id{s}];
      const bool on_wheel = one.timed && one.next_due != rt::never; // one that is never due is not there
      if (!fits(one.waiting) || on_wheel != due_.armed(subscription_id{s})) return false;
      ready += one.ready;
      owed += one.owes_last;
    }
    for (const ready_list& on : of.ready) {
      for (subscription_id s = on.head; s && ready != UINT32_MAX; s = subscriptions_[s].next_ready) {
        const subscription& one = subscriptions_[s];
        if (one.connection != i.value || !one.ready ||
            &of.ready[static_cast<std::size_t>(one.ready_as)] != &on)
          return false;
        --ready;
      }
    }
    if (ready != 0 || owed != of.owed || !charged(i)) return false;
  }
  std::uint64_t references = 0;
  std::uint64_t others = 0;
  for (std::uint32_t i = 0; i < slots_.count(); ++i) {
    const bool in_use = slots_.references(i) != 0;
    references += weight(i) * slots_.references(i);
    others += weight(i) * slots_.begun(i) + (in_use && slots_.kept(i) ? weight(i) : 0);
  }
  return left == 0 && scheduled == scheduled_.count() && references == queued + others;
}

} // namespace rowe::service
