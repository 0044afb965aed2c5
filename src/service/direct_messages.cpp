// SPDX-License-Identifier: Apache-2.0
#include "service/direct_messages.hpp"

#include <cassert>
#include <utility>

#include "service/checked_text.hpp"
#include "service/shares.hpp"

namespace rowe::service {

direct_messages::direct_messages(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : bounds_{bounds},
      cycle_{parts.cycle},
      shown_{parts.shown},
      peers_{parts.peers},
      calls_{parts.calls},
      store_{parts.store},
      out_{parts.out},
      slots_{parts.store.slots()},
      delivery_{parts.delivery},
      inbox_{parts.inbox},
      validator_{parts.validator},
      trackers_{memory, bounds, parts.claimants},
      parked_{memory.carve<parked>(bounds.connections_max)} {}

void direct_messages::forget(peer_index peer) noexcept {
  parked_[peer] = {};
  if (std::exchange(out_.of(peer).told_full, false)) --told_full_;
  room_came_ = true; // a sender that waits for room there need not wait any more
}

// ---- turns, and what is parked in them

// False: the peer has its share of the sender's slots already. `to` null: for everyone. Messages that were
// parked before are counted in each turn, too; they stay parked, whatever the shares are now.
bool direct_messages::may_park(const direct_message& m, connection* to) noexcept {
  if (to == nullptr) {
    ++turn_parked_;
    ++turn_parked_for_all_;
    return true;
  }
  const peer_index peer{to->id.index};
  parked& of = parked_[peer];
  if (std::exchange(of.turn, turn_) != turn_) of.count = 0;
  if (!m.parked && of.count + turn_parked_ >= turn_slots_) return false;
  ++of.count;
  ++turn_parked_;
  if (turn_of_receiver_) inbox_.count_answer(peer);
  if (of.count + turn_parked_ >= turn_slots_ && !std::exchange(out_.of(peer).told_full, true)) {
    ++told_full_;
    shown_.set_taking(peer.value, 0);
  }
  return true;
}

void direct_messages::show_room() noexcept {
  for (const peer_index i : peers_.ids()) {
    peer_queues& queues = out_.of(i);
    if (!queues.told_full || parked_[i].turn > cycle_turn_) continue;
    queues.told_full = false;
    --told_full_;
    shown_.set_taking(i.value, peers_[i].id.generation);
    ++cycle_.places_freed;
    room_came_ = true;
  }
}

bool direct_messages::post(const direct_message& m) noexcept {
  connection* const to = peers_.find({m.to.index, m.to.generation}); // null: everyone, or gone
  const bool gone = to == nullptr && m.to.generation != 0;
  // It must not overtake a parked message for the same peer or for everyone.
  const bool behind = all_parked_in_ == turn_ || (to != nullptr && parked_[{m.to.index}].turn == turn_);
  if (behind && !gone && !cycle_.closing && (m.only_now || m.expires >= cycle_.now)) {
    if (!m.only_now && may_park(m, to)) return false;
    add(counter::outbox_full);
    delivery_.complete(m.sender, m.own, m.only_now ? errc::expired : errc::full);
    return true;
  }
  if (send(m)) return true;
  // No room at the peer, or no slot. Or no peer at all has room; then no later message may overtake this one.
  if (to == nullptr) all_parked_in_ = turn_;
  if (may_park(m, to)) return false;
  add(counter::outbox_full);
  delivery_.complete(m.sender, m.own, errc::full);
  return true;
}

// ---- sending

// Whether a message may be sent now. It is parked while none of its peers has room, so that its sender finds
// the handle full and loses nothing. It also stays behind messages that are pending already. One of several
// peers that does not read must not hold up the others.
inline bool direct_messages::has_room_for(const direct_message& m) noexcept {
  if (m.to.generation != 0) {
    const peer_index to{m.to.index};
    return has_room(to, m.priority) &&
           trackers_.has_share(to, out_.of(to).backpressured(), slots_.class_for(m.text.size()));
  }
  bool any = false;
  for (const peer_index i : peers_.ids()) {
    if (!peers_[i].open() || !peers_[i].takes_messages) continue;
    if (pending() == 0 && parked_[i].turn != turn_ && has_room(i, m.priority)) return true;
    any = true;
  }
  // Messages that are pending until a peer comes leave a quarter of the slots free.
  return !any && pending() < slots_.count() - slots_.count() / 4;
}

// False: it must be parked. Else its sender is told the outcome, at once or later.
inline bool direct_messages::send(const direct_message& m) noexcept {
  const auto fails = [&](const status& why, counter as) {
    add(as);
    delivery_.complete(m.sender, m.own, why);
    return true;
  };
  if (cycle_.closing) return fails(errc::closed, counter::lost_at_close);
  // Only now means: in the cycle that takes it, however long it was queued before.
  const rt::time_point expires = m.only_now ? cycle_.now : m.expires;
  if (expires < cycle_.now) return fails(errc::expired, counter::expired);
  if (m.to.generation != 0) {
    const connection* const to = peers_.find({m.to.index, m.to.generation});
    if (to == nullptr || !to->open()) return fails(errc::peer_lost, counter::lost_with_peer);
  }
  if (m.text.size() > store_.text_bytes_max()) {
    return fails(error{errc::too_big, static_cast<std::int64_t>(m.text.size()),
                       static_cast<std::int64_t>(store_.text_bytes_max())},
                 counter::too_big);
  }
  if (!has_room_for(m)) return m.only_now ? fails(errc::expired, counter::outbox_full) : false;
  const slot_class of = slots_.class_for(m.text.size());
  // Slots that topics and answers hold beyond this can be evicted for it.
  if (trackers_.slots_left(of) == 0) return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  // The text is checked last, since parked messages come by here in every cycle.
  if (const status fine = check_object_text(validator_, m.text); !fine)
    return fails(fine, fine.code() == errc::too_big ? counter::too_big : counter::malformed);
  if (slots_.free_for_all(of) == 0 && !out_.evict_for(of))
    return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  const slot_id slot = out_.compose(expires, [&](json::writer& into) { into.append(m.text); });
  assert(slot);
  begin(slot, {.priority = m.priority, .everyone = m.to.generation == 0, .sender = m.sender, .own = m.own});
  if (m.to.generation != 0) {
    (void)queue_to({m.to.index}, slot); // has_room_for() said so
  } else {
    for (const peer_index i : peers_.ids()) {
      if (!peers_[i].open() || !peers_[i].takes_messages) continue;
      if (parked_[i].turn == turn_) {
        add(counter::outbox_full); // it would overtake a message parked for that peer
      } else {
        if (has_room(i, m.priority)) {
          (void)queue_to(i, slot);
        } else {
          add(counter::outbox_full);
        }
      }
    }
  }
  end_queueing(slot);
  return true;
}

// Tracks it from now on. A message to everyone keeps its slot until it was sent.
inline void direct_messages::begin(slot_id slot, const tracker& as) noexcept {
  take_outcomes(); // of the slot's former message
  assert(!trackers_.under_way(slot));
  trackers_.begin(slot, as);
  store_.track(slot, as.everyone);
}

// False, counted, when the peer's queue is full.
inline bool direct_messages::queue_to(peer_index to, slot_id slot) noexcept {
  const tracker& one = trackers_.at(slot);
  if (!out_.push_direct(to, one.priority, slot)) return false;
  if (!one.everyone) trackers_.charge(slot, to);
  return true;
}

// If it has no delivery, it is pending or has ended.
inline void direct_messages::end_queueing(slot_id slot) noexcept {
  if (!trackers_.at(slot).everyone) return store_.release(slot);
  if (slots_.references(slot) == 1) settle(slot, false);
}

// ---- of calls

status direct_messages::send_request(slot_id slot, peer_index to, detail::call_ref call,
                                     bool stops) noexcept {
  begin(slot, {.everyone = !to, .request_of = call});
  const bool may =
      !to || stops || trackers_.has_share(to, out_.of(to).backpressured(), slots_.class_of(slot));
  if (to && may && !has_room(to, trackers_.at(slot).priority)) {
    add(counter::outbox_full);
    return errc::full;
  }
  if (to && (!may || !queue_to(to, slot))) return errc::full;
  end_queueing(slot);
  return {};
}

void direct_messages::track_reply(slot_id slot, const call_endpoint& sender, detail::call_ref own) noexcept {
  take_outcomes(); // of the slot's former message
  trackers_.at(slot) = {.now = tracker::state::queued, .sender = sender, .own = own};
  store_.track(slot, false);
}

void direct_messages::cancel(slot_ref which) noexcept {
  take_outcomes();
  if (!which.index || !slots_.alive(which) || !trackers_.under_way(which.index)) return;
  trackers_.at(which.index).sender = {};
  if (store_.cancel(which)) trackers_.forget(which.index);
}

// ---- ends

void direct_messages::settle_outcomes() noexcept {
  for (outcome what; store_.take_outcome(what);) {
    tracker& one = trackers_.at(what.slot);
    if (what.sent) {
      one.sent = true;
      // One peer is enough: the others may not read for a long time.
      delivery_.complete(std::exchange(one.sender, {}), one.own, {});
    }
    if (what.expired) {
      const tracker over = one;
      trackers_.forget(what.slot);
      delivery_.complete(over.sender, over.own, over.sent ? status{} : status{errc::expired});
    } else if (what.ended) {
      settle(what.slot, what.evicted);
    }
  }
}

// All deliveries of a message have ended, one way or the other.
inline void direct_messages::settle(slot_id slot, bool evicted) noexcept {
  const tracker& one = trackers_.at(slot);
  if (one.now == tracker::state::waiting) return; // it is pending, with no delivery
  if (one.sent) return end(slot, {});
  if (cycle_.closing) return end(slot, errc::closed);
  if (!one.everyone) return end(slot, evicted ? errc::full : errc::peer_lost);
  if (slots_.expires(slot) <= cycle_.now) {
    add(counter::expired);
    return end(slot, errc::expired);
  }
  trackers_.wait(slot);
}

inline void direct_messages::end(slot_id slot, const status& outcome) noexcept {
  const tracker over = trackers_.at(slot);
  trackers_.forget(slot);
  if (slots_.kept(slot)) store_.let_go(slot);
  delivery_.complete(over.sender, over.own, outcome);
}

// ---- what is pending

void direct_messages::deliver_pending(peer_index peer) noexcept {
  for (slot_id slot = trackers_.first_waiting(); slot; slot = trackers_.first_waiting()) {
    if (slots_.expires(slot) < cycle_.now) {
      store_.expire(slot);
      take_outcomes();
      continue;
    }
    tracker& one = trackers_.at(slot);
    if (!has_room(peer, one.priority)) return;
    trackers_.stop_waiting(slot);
    if (call* const asked = calls_.find(one.request_of)) {
      asked->callee = call_endpoint::of(peers_[peer].id, asked->callee.speaks);
      one.everyone = false;
    }
    (void)queue_to(peer, slot); // there is room
  }
}

// No peer has got room if nothing left a queue and no slot was freed since the last look.
void direct_messages::place_all_pending() noexcept {
  const std::uint64_t changes = out_.room_changes() + trackers_.began_to_wait();
  if (std::exchange(looked_for_room_at_, changes) == changes) return;
  for (const peer_index i : peers_.ids()) {
    if (pending() == 0) return;
    if (peers_[i].open() && peers_[i].takes_messages) deliver_pending(i);
  }
}

void direct_messages::close() noexcept {
  take_outcomes();
  while (pending() != 0) {
    add(counter::lost_at_close);
    end(trackers_.first_waiting(), errc::closed);
  }
}

// ---- for tests

// Each message under way has a tracked slot, unless its outcome is still to be taken.
bool direct_messages::check() const noexcept {
  if (!trackers_.check()) return false;
  for (const slot_id i : slots_.ids()) {
    if (trackers_.under_way(i) != (slots_.references(i) != 0 && slots_.tracked(i))) return false;
  }
  std::uint32_t told_full = 0;
  for (const peer_index i : peers_.ids())
    told_full += peers_[i].state != connection::phase::free && out_.of(i).told_full;
  return told_full == told_full_;
}

} // namespace rowe::service
