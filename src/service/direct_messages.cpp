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
      messages_{memory, bounds, parts.claimants},
      parked_{memory.carve<parked>(bounds.connections_max)} {}

void direct_messages::forget(peer_index peer) noexcept {
  parked_[peer] = {};
  if (std::exchange(out_.of(peer).told_full, false)) --told_full_;
  room_came_ = true; // whoever waits for room there need not wait any more
}

// ---- turns, and what is parked in them

// False where the peer has its share of the sender's slots already. `to` null: for everyone. Asked in each
// turn for what was parked before, too, which stays whatever the shares are by now.
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
  // Not past one that is parked already and was for the same peer, or for everyone.
  const bool behind = all_parked_in_ == turn_ || (to != nullptr && parked_[{m.to.index}].turn == turn_);
  if (behind && !gone && !cycle_.closing && (m.only_now || m.expires >= cycle_.now)) {
    if (!m.only_now && may_park(m, to)) return false;
    add(counter::outbox_full);
    delivery_.complete(m.sender, m.own, m.only_now ? errc::expired : errc::full);
    return true;
  }
  if (send(m)) return true;
  // A peer has no room, or no slot. Or nobody has, and then no later one may pass.
  if (to == nullptr) all_parked_in_ = turn_;
  if (may_park(m, to)) return false;
  add(counter::outbox_full);
  delivery_.complete(m.sender, m.own, errc::full);
  return true;
}

// ---- sending

// A message waits where it is while no peer that it may go to has room, so that its sender finds the handle
// full instead of losing something; and behind those that are pending already. Among several peers one that
// does not read must not stop the others.
inline bool direct_messages::has_room_for(const direct_message& m) noexcept {
  if (m.to.generation != 0) {
    const peer_index to{m.to.index};
    return has_room(to, m.priority) &&
           messages_.has_share(to.value, out_.of(to).backpressured(), slots_.class_for(m.text.size()));
  }
  bool any = false;
  for (const peer_index i : peers_.ids()) {
    if (!peers_[i].open() || !peers_[i].takes_messages) continue;
    if (pending() == 0 && parked_[i].turn != turn_ && has_room(i, m.priority)) return true;
    any = true;
  }
  // A quarter of the slots is never taken by what waits for a peer to come.
  return !any && pending() < slots_.count() - slots_.count() / 4;
}

// False when it must wait for room. Else its sender is told what comes of it, at once or later.
inline bool direct_messages::send(const direct_message& m) noexcept {
  const auto fails = [&](const status& why, counter as) {
    add(as);
    delivery_.complete(m.sender, m.own, why);
    return true;
  };
  if (cycle_.closing) return fails(errc::closed, counter::lost_at_close);
  // Only now: in the cycle that takes it, however long it has lain in its ring.
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
  // What topics and answers have taken of these is evicted for it.
  if (messages_.slots_left(of) == 0) return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  // Last, since what is parked comes by here in every cycle.
  if (const status fine = check_object_text(validator_, m.text); !fine)
    return fails(fine, fine.code() == errc::too_big ? counter::too_big : counter::malformed);
  if (slots_.free_for_all(of) == 0 && !out_.evict_for(of))
    return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  const std::uint32_t slot = out_.compose(expires, [&](json::writer& into) { into.append(m.text); });
  assert(slot != no_index);
  begin(slot, {.priority = m.priority, .everyone = m.to.generation == 0, .sender = m.sender, .own = m.own});
  if (m.to.generation != 0) {
    (void)queue_to({m.to.index}, slot); // has_room_for() said so
  } else {
    for (const peer_index i : peers_.ids()) {
      if (!peers_[i].open() || !peers_[i].takes_messages) continue;
      if (parked_[i].turn == turn_) {
        add(counter::outbox_full); // it comes behind what is parked for that peer
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

// Tracked from now on. One that may go to any peer keeps its slot until it was sent.
inline void direct_messages::begin(std::uint32_t slot, const letter& as) noexcept {
  take_outcomes(); // of who had the slot before
  assert(!messages_.under_way(slot));
  messages_.begin(slot, as);
  store_.track(slot, as.everyone);
}

// False, counted, when the peer's queue is full.
inline bool direct_messages::queue_to(peer_index to, std::uint32_t slot) noexcept {
  const letter& one = messages_.at(slot);
  if (!out_.push_direct(to, one.priority, slot)) return false;
  if (!one.everyone) messages_.charge(slot, to.value);
  return true;
}

// With no delivery it is pending, or over.
inline void direct_messages::end_queueing(std::uint32_t slot) noexcept {
  if (!messages_.at(slot).everyone) return store_.release(slot);
  if (slots_.references(slot) == 1) settle(slot, false);
}

// ---- of calls

status direct_messages::send_request(std::uint32_t slot, peer_index to, detail::call_ref call,
                                     bool stops) noexcept {
  begin(slot, {.everyone = !to, .request_of = call});
  const bool may =
      !to || stops || messages_.has_share(to.value, out_.of(to).backpressured(), slots_.class_of(slot));
  if (to && may && !has_room(to, messages_.at(slot).priority)) {
    add(counter::outbox_full);
    return errc::full;
  }
  if (to && (!may || !queue_to(to, slot))) return errc::full;
  end_queueing(slot);
  return {};
}

void direct_messages::track_reply(std::uint32_t slot, const party& sender, detail::call_ref own) noexcept {
  take_outcomes(); // of who had the slot before
  messages_.at(slot) = {.now = letter::state::queued, .sender = sender, .own = own};
  store_.track(slot, false);
}

void direct_messages::cancel(slot_ref which) noexcept {
  take_outcomes();
  if (which.index == no_index || !slots_.alive(which) || !messages_.under_way(which.index)) return;
  messages_.at(which.index).sender = {};
  if (store_.cancel(which)) messages_.forget(which.index);
}

// ---- ends

void direct_messages::settle_outcomes() noexcept {
  for (outcome what; store_.take_outcome(what);) {
    letter& one = messages_.at(what.slot);
    if (what.sent) {
      one.sent = true;
      // One peer is enough: the others may not read for long.
      delivery_.complete(std::exchange(one.sender, {}), one.own, {});
    }
    if (what.expired) {
      const letter over = one;
      messages_.forget(what.slot);
      delivery_.complete(over.sender, over.own, over.sent ? status{} : status{errc::expired});
    } else if (what.ended) {
      settle(what.slot, what.evicted);
    }
  }
}

// All deliveries of a message have ended, one way or the other.
inline void direct_messages::settle(std::uint32_t slot, bool evicted) noexcept {
  const letter& one = messages_.at(slot);
  if (one.now == letter::state::waiting) return; // it has none yet
  if (one.sent) return end(slot, {});
  if (cycle_.closing) return end(slot, errc::closed);
  if (!one.everyone) return end(slot, evicted ? errc::full : errc::peer_lost);
  if (slots_.expires(slot) <= cycle_.now) {
    add(counter::expired);
    return end(slot, errc::expired);
  }
  messages_.wait(slot);
}

inline void direct_messages::end(std::uint32_t slot, const status& outcome) noexcept {
  const letter over = messages_.at(slot);
  messages_.forget(slot);
  if (slots_.kept(slot)) store_.let_go(slot);
  delivery_.complete(over.sender, over.own, outcome);
}

// ---- what is pending

void direct_messages::deliver_pending(peer_index peer) noexcept {
  for (std::uint32_t slot = messages_.first_waiting(); slot != no_index; slot = messages_.first_waiting()) {
    if (slots_.expires(slot) < cycle_.now) {
      store_.expire(slot);
      take_outcomes();
      continue;
    }
    letter& one = messages_.at(slot);
    if (!has_room(peer, one.priority)) return;
    messages_.stop_waiting(slot);
    if (call* const asked = calls_.find(one.request_of)) {
      asked->provider = party::of(peers_[peer].id, asked->provider.speaks);
      one.everyone = false;
    }
    (void)queue_to(peer, slot); // there is room
  }
}

// Nobody has got room since the last look if nothing was taken out of any queue and no slot became free.
void direct_messages::place_all_pending() noexcept {
  const std::uint64_t changes = out_.room_changes() + messages_.began_to_wait();
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
    end(messages_.first_waiting(), errc::closed);
  }
}

// ---- for tests

// Each message under way has a tracked slot, but for an outcome that is to be taken.
bool direct_messages::check() const noexcept {
  if (!messages_.check()) return false;
  for (std::uint32_t i = 0; i < slots_.count(); ++i) {
    if (messages_.under_way(i) != (slots_.references(i) != 0 && slots_.tracked(i))) return false;
  }
  std::uint32_t told_full = 0;
  for (const peer_index i : peers_.ids())
    told_full += peers_[i].state != connection::phase::free && out_.of(i).told_full;
  return told_full == told_full_;
}

} // namespace rowe::service
