// SPDX-License-Identifier: Apache-2.0
// What peers are to be given. A message is encoded once into a slot; each subscription queues the slot's
// number; each connection that has something to write is put on a list, and writing.cpp writes it. Whether a
// message may still be sent is decided by the clock, when it is handed over; the wheel only gives the slots
// of those back that nobody came to send.
#include <cassert>
#include <cstring>
#include <optional>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/publishing.hpp"

namespace rowe::service {

namespace {

// As much work as to compose so many bytes: one place in a queue, and one taken from whoever holds most.
constexpr std::size_t push_work = 128;
constexpr std::size_t eviction_work = 1024;

} // namespace

// ---- towards the queues

void core::deliver(std::uint32_t topic_index, std::uint32_t slot) noexcept {
  const topic& on = router_.at(topic_index);
  for (std::uint32_t i = on.first_subscription; i != no_index; i = router_.subscription_at(i).next_on_topic) {
    if (accepts(router_.subscription_at(i))) push(i, slot);
  }
}

// rosbridge's throttle: what comes within the period of the last one written is discarded, unless the peer
// asked for a queue.
bool core::accepts(subscription& s) noexcept {
  if (!s.discards || now_ >= s.next_due) return true;
  add(counter::throttled);
  return false;
}

void core::push(std::uint32_t index, std::uint32_t slot) noexcept {
  subscription& s = router_.subscription_at(index);
  work_bytes_ += push_work;
  if (s.owes_last) place_latched(s);
  drop_dead(s.waiting);
  if (s.waiting.count >= s.depth) trim(s, s.depth - 1);
  if (!enqueue(s.waiting, slot)) return add(counter::outbox_full);
  slots_.retain(slot);
  make_ready(index);
}

// Drops the oldest messages of a subscription until it holds `most`.
void core::trim(subscription& s, std::uint32_t most) noexcept {
  for (drop_dead(s.waiting); s.waiting.count > most; ROWE_MUTANT(depth) ? void() : drop_dead(s.waiting)) {
    // Why it goes: the peer wants the newest only, or less often, or does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !peers_[peer_index{s.connection}].behind();
    add(s.merges || s.discards ? counter::replaced : chosen ? counter::throttled : counter::outbox_full);
    drop_front(s.waiting);
  }
}

// What a peer asked of a subscription has changed: depth, throttle, or how often its topic is kept.
void core::merge_requests(std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  router_.merge(s, bounds_.queue_depth_max);
  if (!ROWE_MUTANT(depth)) trim(s, s.depth);
  if (ROWE_MUTANT(throttle)) return;
  s.next_due = s.sent_at == rt::time_point{} ? s.sent_at : rt::deadline_after(s.sent_at, s.throttle);
  if (std::exchange(s.timed, false)) timers_.disarm(subscription_id{index});
  make_ready(index);
}

void core::make_ready(std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  if (s.ready || (s.waiting.empty() && !s.owes_last)) return;
  if (now_ < s.next_due) {
    if (!std::exchange(s.timed, true)) timers_.arm(subscription_id{index}, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) timers_.disarm(subscription_id{index});
  connection& c = peers_[peer_index{s.connection}];
  s.ready_as = router_.at(s.topic).priority;
  ready_list& on = c.ready[static_cast<std::size_t>(s.ready_as)];
  s.ready = true;
  s.next_ready = no_index;
  (on.head == no_index ? on.head : router_.subscription_at(on.tail).next_ready) = index;
  on.tail = index;
  list(c);
}

void core::send_direct(connection& c, std::string_view text) noexcept {
  if (text.empty()) return add(counter::outbox_full);
  (void)answer(c, [&](json::writer& into) { into.append(text); }); // what is lost is counted there
}

void core::send_control(connection& c, wire::opcode what, std::span<const std::byte> payload) noexcept {
  place_control(c, what, payload);
  list(c);
}

void core::place_control(connection& c, wire::opcode what, std::span<const std::byte> payload) noexcept {
  if (options_.profile != peer_profile::standard) return; // Hop's programs know text frames only
  const wire::role ours = masks(c) ? wire::role::client : wire::role::server;
  const std::size_t bytes = wire::frame_header_bytes(payload.size(), ours) + payload.size();
  std::byte* const at = c.control.place(what, bytes);
  if (at == nullptr) return;
  if (ours == wire::role::client) {
    const wire::mask_key key = next_mask();
    const std::size_t header = wire::write_frame_header(at, what, payload.size(), key);
    wire::mask_copy({at + header, payload.size()}, payload, key);
  } else {
    const std::size_t header = wire::write_frame_header(at, what, payload.size());
    if (!payload.empty()) std::memcpy(at + header, payload.data(), payload.size());
  }
}

wire::mask_key core::next_mask() noexcept {
  wire::mask_key key;
  if (masks_used_ + key.size() > masks_.size()) {
    random_.fill(masks_);
    masks_used_ = 0;
  }
  std::memcpy(key.data(), masks_.data() + masks_used_, key.size());
  masks_used_ += key.size();
  return key;
}

// A slot's text is complete: the frame header goes in front of it. The wheel learns when it ends at the end
// of the cycle, if it is still there.
void core::seal(std::uint32_t slot, std::size_t bytes, rt::time_point expires) noexcept {
  slots_.finish(slot, bytes, expires);
  work_bytes_ += bytes;
  (void)wire::write_frame_header_before(reinterpret_cast<std::byte*>(slots_.text(slot).data()),
                                        wire::opcode::text,
                                        bytes); // where it starts follows from `bytes`
  if (expires == rt::never) return;
  if (expires == now_) offers_to_all_ = true;
  if (sealed_count_ == sealed_.size()) return timers_.arm(slot_id{slot}, expires + rt::duration{1});
  sealed_[sealed_count_++] = slot;
}

// ---- giving back

// What only its own letter holds any more has no deliveries left: it is settled.
void core::release(std::uint32_t slot) noexcept {
  if (slots_.release(slot)) return timers_.disarm(slot_id{slot});
  if (is_letter(slot) && slots_.references(slot) == 1) settle_letter(slot);
}

// The clock decides; the wheel only noticed.
void core::expire_slot(std::uint32_t slot) noexcept {
  if (slots_.expires(slot) >= now_) return timers_.arm(slot_id{slot}, slots_.expires(slot) + rt::duration{1});
  const auto deliveries = slots_.expire(slot);
  // In the middle of being written: it goes when the socket has it all, or with its connection.
  if (!deliveries) return timers_.arm(slot_id{slot}, now_ + std::chrono::milliseconds{10});
  timers_.disarm(slot_id{slot});
  const bool waited = letters_.under_way(slot) && *deliveries == 0;
  add(counter::expired, *deliveries + (waited ? 1 : 0));
  if (letters_.under_way(slot)) expire_letter(slot);
}

// Drops the message at the front if it is gone or its time is. False when the queue begins with one to be
// sent.
bool core::drop_dead_front(queue& from) noexcept {
  if (from.empty()) return false;
  const slot_ref front = entries_.front(from);
  if (slots_.alive(front)) {
    if (slots_.expires(front.index) >= now_) return false;
    expire_slot(front.index); // for all queues at once, and counted
    if (slots_.alive(front)) {
      // Another peer's socket is in the middle of it, so it goes for this peer alone.
      add(counter::expired);
      release(front.index);
    }
  }
  (void)entries_.pop(from); // the reference is given back already
  return true;
}

void core::drop_front(queue& from) noexcept { release(entries_.pop(from).index); }

void core::drop_all(queue& from, counter as) noexcept {
  while (!from.empty()) {
    if (drop_dead_front(from)) continue;
    add(as);
    drop_front(from);
  }
}

// Frees a slot of a class at the cost of a peer that has more than an equal share of them queued: its oldest
// message goes, and the next one as long as others hold the same. So nobody who holds less loses anything for
// want of slots ("longest queue drop": Suter, Lakshman, Stiliadis and Choudhury, IEEE INFOCOM 1998). False
// when there is nothing to evict, or when so many evictions freed none.
bool core::reclaim(slot_class of) noexcept {
  constexpr unsigned evictions_max = 64;
  for (unsigned left = evictions_max; left != 0; --left) {
    const std::uint32_t most = holds_most(of);
    if (most == no_index || (ROWE_MUTANT(hoarder) && !peers_[peer_index{most}].behind())) return false;
    evict(peers_[peer_index{most}], of);
    if (slots_.free_for_all(of) != 0) return true;
  }
  return false;
}

// Who has more than an equal share; of several that hold as much, one that does not read.
std::uint32_t core::holds_most(std::optional<slot_class> of) noexcept {
  const std::uint32_t all = of ? slots_.count(*of) : bounds_.queued_max;
  return entries_.longest(of, all / std::max(peers_.count(), 1U),
                          [this](std::uint32_t i) { return peers_[peer_index{i}].behind(); });
}

// The same for the entries of queues.
void core::reclaim_entry() noexcept {
  const std::uint32_t most = holds_most(std::nullopt);
  if (most != no_index) evict(peers_[peer_index{most}], std::nullopt);
}

// Takes the oldest message out of the longest queue of a peer, of those that begin with a slot of the class
// if there is one. The peer has something queued.
void core::evict(connection& c, std::optional<slot_class> of) noexcept {
  work_bytes_ += eviction_work;
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
  look_at(c.direct, no_index);
  for (std::uint32_t i = c.first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_connection) {
    look_at(router_.subscription_at(i).waiting, router_.subscription_at(i).topic);
  }
  assert(longest != nullptr);
  if (drop_dead_front(*longest)) return;
  const slot_ref oldest = entries_.front(*longest);
  if (is_letter(oldest.index)) letters_.at(oldest.index).lost_as = errc::full; // an answer that is waited for
  add(c.behind() ? counter::outbox_full : counter::evicted);
  drop_front(*longest);
  if (topic == no_index) return;
  // Those who do not read, and those who hold more than an equal share, lose it, too: as a rule they hold
  // what the first one holds, and the slot is free only when nobody does.
  const slot_class its = slots_.class_of(oldest.index);
  const std::uint32_t share = slots_.count(its) / std::max(peers_.count(), 1U);
  const auto may_lose_it = [&](const connection& one) {
    return one.behind() || entries_.held_by(one.id.index, queued_as::evictable, its) > share;
  };
  for (std::uint32_t i = router_.at(topic).first_subscription; i != no_index && slots_.alive(oldest);
       i = router_.subscription_at(i).next_on_topic) {
    subscription& same = router_.subscription_at(i);
    const connection& its_peer = peers_[peer_index{same.connection}];
    if (same.waiting.empty() || entries_.front(same.waiting) != oldest || !may_lose_it(its_peer)) continue;
    add(its_peer.behind() ? counter::outbox_full : counter::evicted);
    drop_front(same.waiting);
  }
}

void core::remove_subscription(connection& c, std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  const std::uint32_t topic = s.topic;
  drop_all(s.waiting, counter::lost_with_peer);
  if (s.owes_last) --c.owed;
  if (s.timed) {
    timers_.disarm(subscription_id{index});
    s.timed = false;
  }
  if (s.ready) {
    ready_list& on = c.ready[static_cast<std::size_t>(s.ready_as)];
    std::uint32_t before = no_index;
    for (std::uint32_t i = on.head; i != index; i = router_.subscription_at(i).next_ready) before = i;
    (before == no_index ? on.head : router_.subscription_at(before).next_ready) = s.next_ready;
    if (on.tail == index) on.tail = before;
    s.ready = false;
  }
  router_.remove_subscription(index, c.first_subscription);
  subscription_claims_.give_back(c.subscriptions);
  update_wanted(topic);
  let_go_topic(topic);
}

// A value of a latched topic, for those who come late. What a handle of this process latches is not replaced
// by peers.
void core::keep_latched(topic& on, std::uint32_t slot, latch_owner owner) noexcept {
  if (owner.who == latch_owner::kind::peer && on.last.owner.who == latch_owner::kind::handle) return;
  const std::span<const char> body = slots_.body(slot);
  if (latches_.store(on.last, {body.data(), body.size()}, owner, slots_.expires(slot))) return;
  add(counter::not_latched);
}

void core::forget_latched(topic& on, latch_owner owner) noexcept {
  if (on.last.owner == owner) latches_.clear(on.last);
}

// Queues the latched value for one who came late; not before it can be written, so that one who subscribes to
// many topics at once does not take as many slots.
void core::place_latched(subscription& of) noexcept {
  of.owes_last = false;
  --peers_[peer_index{of.connection}].owed;
  const std::uint32_t slot = compose_latched(of.topic);
  if (slot == no_index) return;
  trim(of, of.depth - 1);
  if (enqueue(of.waiting, slot)) return; // with its reference
  add(counter::outbox_full);
  release(slot);
}

// The latched value as a message in a slot of its own, with one reference; no_index where there is none, or
// no slot, which is counted.
std::uint32_t core::compose_latched(std::uint32_t topic_index) noexcept {
  topic& on = router_.at(topic_index);
  if (!on.last.empty() && on.last.expires < now_) latches_.clear(on.last);
  if (on.last.empty()) return no_index;
  return encode(topic_index, on.last.expires, [&](json::writer& into) { latches_.write(on.last, into); });
}

void core::let_go_topic(std::uint32_t index) noexcept {
  if (router_.at(index).holders == 1) latches_.clear(router_.at(index).last);
  (void)router_.let_go(index); // whether it was the last one matters to nobody here
}

// Of a handle of this process.
void core::let_go_own_topic(std::uint32_t index) noexcept {
  if (router_.at(index).holders == 1) latches_.clear(router_.at(index).last);
  (void)router_.let_go_as_own(index); // likewise
}

} // namespace rowe::service
