// SPDX-License-Identifier: Apache-2.0
// What peers are to be given. A message is encoded once into a slot; each subscription queues the slot's
// number; each connection that has something to write is put on a list, and writing.cpp writes it. Whether a
// message may still be sent is decided by the clock, when it is handed over; the wheel only gives the slots
// of those back that nobody came to send.
#include <cstring>
#include <utility>

#include "service/core.hpp"
#include "service/publishing.hpp"

namespace rowe::service {

// ---- towards the queues

void core::deliver(std::uint32_t topic_index, std::uint32_t slot) noexcept {
  topic& on = router_.at(topic_index);
  if (on.latched) {
    forget_last(on);
    slots_.keep(slot);
    on.last = slots_.ref(slot);
  }
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
  drop_dead(s.waiting);
  while (s.waiting.count >= s.depth) {
    // Why it goes: the peer wants the newest only, or less often, or does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !connections_[s.connection].behind();
    add(s.merges || s.discards ? counter::replaced : chosen ? counter::throttled : counter::outbox_full);
    drop_front(s.waiting);
  }
  if (!entries_.push(s.waiting, slots_.ref(slot))) return add(counter::outbox_full);
  slots_.retain(slot);
  make_ready(index);
}

void core::make_ready(std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  if (s.ready || s.waiting.empty()) return;
  if (now_ < s.next_due) {
    if (!std::exchange(s.timed, true)) arm(timer::subscription, index, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) disarm(timer::subscription, index);
  connection& c = connections_[s.connection];
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
  (void)wire::write_frame_header_before(reinterpret_cast<std::byte*>(slots_.text(slot).data()),
                                        wire::opcode::text,
                                        bytes); // where it starts follows from `bytes`
  if (expires == rt::never) return;
  if (expires == now_) offers_to_all_ = true;
  if (sealed_count_ == sealed_.size()) return arm(timer::slot, slot, expires + rt::duration{1});
  sealed_[sealed_count_++] = slot;
}

// ---- giving back

// What only its own letter holds any more has no deliveries left: it is settled.
void core::release(std::uint32_t slot) noexcept {
  if (slots_.release(slot)) return wheel_.cancel(slot); // its node's number is its own: node_of()
  if (is_letter(slot) && slots_.references(slot) == 1) settle_letter(slot);
}

// The clock decides; the wheel only noticed.
void core::expire_slot(std::uint32_t slot) noexcept {
  if (slots_.expires(slot) >= now_) return arm(timer::slot, slot, slots_.expires(slot) + rt::duration{1});
  const auto deliveries = slots_.expire(slot);
  // In the middle of being written: it goes when the socket has it all, or with its connection.
  if (!deliveries) return arm(timer::slot, slot, now_ + std::chrono::milliseconds{10});
  disarm(timer::slot, slot);
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

// Frees a slot for so many bytes at the cost of peers that do not read: a message that is the oldest in the
// queue of one of them is dropped there and wherever else it is the oldest. So a few that do not read cannot
// take all slots away from those that do. Looks at each subscription once at most, and first where it found
// one last: that peer has more as a rule.
bool core::reclaim(std::size_t bytes) noexcept {
  const auto from_one = [&](auto&& takes_from) {
    for (std::size_t i = 0; i < connections_.size(); ++i) {
      connection& c = connections_[(reclaimed_at_ + i) % connections_.size()];
      if (!c.open() || !takes_from(c)) continue;
      reclaimed_at_ = c.id.index;
      return true;
    }
    return false;
  };
  return from_one([&](connection& c) { return c.behind() && reclaim_message(c, bytes); }) ||
         from_one([&](connection& c) { return reclaim_answer(c, bytes); });
}

bool core::reclaim_message(connection& c, std::size_t bytes) noexcept {
  for (std::uint32_t i = c.first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_connection) {
    queue& waiting = router_.subscription_at(i).waiting;
    drop_dead(waiting);
    if (waiting.empty() || slots_.room(entries_.front(waiting).index).size() < bytes) continue;
    const slot_ref oldest = entries_.front(waiting);
    const std::uint32_t topic = router_.subscription_at(i).topic;
    for (std::uint32_t k = router_.at(topic).first_subscription; k != no_index;
         k = router_.subscription_at(k).next_on_topic) {
      subscription& same = router_.subscription_at(k);
      if (!connections_[same.connection].behind() || same.waiting.empty() ||
          entries_.front(same.waiting) != oldest || !slots_.alive(oldest)) {
        continue;
      }
      add(counter::outbox_full);
      drop_front(same.waiting);
    }
    if (slots_.has_free(bytes)) return true;
  }
  return false;
}

// The oldest one; not one whose sender waits to hear of it.
bool core::reclaim_answer(connection& c, std::size_t bytes) noexcept {
  drop_dead(c.direct);
  if (c.direct.count <= (c.behind() ? 0 : direct_depth_behind)) return false;
  const std::uint32_t oldest = entries_.front(c.direct).index;
  if (letters_.under_way(oldest) || slots_.room(oldest).size() < bytes) return false;
  add(counter::outbox_full);
  drop_front(c.direct);
  return slots_.has_free(bytes);
}

void core::remove_subscription(connection& c, std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  const std::uint32_t topic = s.topic;
  drop_all(s.waiting, counter::lost_with_peer);
  if (s.timed) {
    disarm(timer::subscription, index);
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
  --c.subscriptions;
  update_wanted(topic);
  let_go_topic(topic);
}

// Gives back what a latched topic keeps for late subscribers.
void core::forget_last(topic& on) noexcept {
  if (on.last.index == no_index || !slots_.alive(on.last)) return;
  slots_.unkeep(on.last.index);
  release(on.last.index);
}

void core::let_go_topic(std::uint32_t index) noexcept {
  topic& held = router_.at(index);
  if (held.holders == 1) forget_last(held);
  (void)router_.let_go(index); // whether it was the last one matters to nobody here
}

} // namespace rowe::service
