// SPDX-License-Identifier: Apache-2.0
#include "service/calls/direct_messages.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "service/base/shares.hpp"
#include "service/calls/checked_text.hpp"

namespace rowe::service {

direct_messages::direct_messages(rt::arena& memory, const direct_messages_needs& parts) noexcept
    : direct_messages_needs{parts},
      slots_{message_store_.slots()},
      trackers_{memory, state_.bounds(), state_.claimants()},
      parking_{memory, state_, outbox_, receiver_} {}

bool direct_messages::post(const direct_message& m) noexcept {
  connection* const to = state_.peers.find({m.to.index, m.to.generation}); // null: everyone, or gone
  const bool gone = to == nullptr && m.to.generation != 0;
  const peer_index peer = to != nullptr ? peer_index{m.to.index} : peer_index{};
  // It must not overtake a parked message for the same peer or for everyone.
  const bool behind = parking_.any_for_everyone() || (to != nullptr && parking_.any_for({m.to.index}));
  if (behind && !gone && !state_.cycle.closing && (m.only_now || m.expires >= state_.cycle.now)) {
    if (!m.only_now && parking_.park(peer, m.parked)) return false;
    add(counter::outbox_full);
    local_delivery_.complete(m.sender, m.own, m.only_now ? errc::expired : errc::full);
    return true;
  }
  if (send(m)) return true;
  // The peer has no room, or no slot is free. If no peer at all has room, no later message may overtake this
  // one.
  if (to == nullptr) parking_.hold_back_later_ones();
  if (parking_.park(peer, m.parked)) return false;
  add(counter::outbox_full);
  local_delivery_.complete(m.sender, m.own, errc::full);
  return true;
}

// ---- sending

// Whether a message may be sent now. It is parked while none of its peers has room, so that its sender finds
// the handle full and loses nothing. It also stays behind messages that are pending already. One of several
// peers that does not read must not hold up the others.
inline bool direct_messages::has_room_for(const direct_message& m, slot_class of) noexcept {
  if (m.to.generation != 0) {
    const peer_index to{m.to.index};
    return has_room(to, m.priority) && trackers_.has_share(to, outbox_.of(to).backpressured(), of);
  }
  bool any = false;
  for (const peer_index i : state_.peers.ids()) {
    if (!state_.peers[i].open() || !state_.peers[i].takes_messages) continue;
    if (pending() == 0 && !parking_.any_for(i) && has_room_to_share(i, m.priority, of, 0)) return true;
    any = true;
  }
  // One that is pending until a peer comes may hold its slot for long, so it leaves what peers have claims
  // to: their calls are sent in the same slots.
  return !any && trackers_.any_unclaimed(of);
}

// False: it must be parked. Else its sender gets the outcome, at once or later.
inline bool direct_messages::send(const direct_message& m) noexcept {
  const auto fails = [&](const status& why, counter as) {
    add(as);
    local_delivery_.complete(m.sender, m.own, why);
    return true;
  };
  if (state_.cycle.closing) return fails(errc::closed, counter::lost_at_close);
  // `only_now` means the cycle that takes the message, however long it was queued before.
  const message_lifetime lifetime =
      m.only_now ? message_lifetime{state_.cycle.now} : message_lifetime::with_ttl(m.expires);
  const bool timed = lifetime.carries_ttl;
  if (lifetime.expires < state_.cycle.now) return fails(errc::expired, counter::expired);
  if (m.to.generation != 0) {
    const connection* const to = state_.peers.find({m.to.index, m.to.generation});
    if (to == nullptr || !to->open()) return fails(errc::peer_lost, counter::lost_with_peer);
  }
  // With its time to live it must still fit into what a peer with our limits takes.
  const std::size_t bytes_max =
      timed ? std::min<std::size_t>(message_store_.text_bytes_max(), state_.bounds().message_bytes_max) -
                  wire::ttl_text_bytes_max - 1
            : message_store_.text_bytes_max();
  if (m.text.size() > bytes_max) {
    return fails(
        error{errc::too_big, static_cast<std::int64_t>(m.text.size()), static_cast<std::int64_t>(bytes_max)},
        counter::too_big);
  }
  const slot_class of = slots_.class_for(m.text.size());
  if (!has_room_for(m, of)) return m.only_now ? fails(errc::expired, counter::outbox_full) : false;
  // Topics and answers may hold the slots beyond this; those can be evicted for it.
  if (trackers_.slots_left(of) == 0) return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  // The text is checked last, because parked messages come here in every cycle.
  if (const status fine = check_object_text(state_.seams.validator, m.text, timed); !fine)
    return fails(fine, fine.code() == errc::too_big ? counter::too_big : counter::malformed);
  if (slots_.free_for_all(of) == 0 && !outbox_.evict_for(of))
    return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  const std::string_view text = timed ? json::root(m.text).raw : m.text; // it begins with the brace
  const slot_id slot = outbox_.compose(lifetime, [&](json::writer& into) { into.append(text); });
  assert(slot);
  begin(slot, {.priority = m.priority, .everyone = m.to.generation == 0, .sender = m.sender, .own = m.own});
  if (m.to.generation != 0) {
    (void)queue_to({m.to.index}, slot); // has_room_for() said so
  } else {
    for (const peer_index i : state_.peers.ids()) {
      if (!state_.peers[i].open() || !state_.peers[i].takes_messages) continue;
      if (parking_.any_for(i)) {
        add(counter::outbox_full); // it would overtake a message parked for that peer
      } else if (has_room_to_share(i, m.priority, of, 1)) {
        (void)queue_to(i, slot); // there is room
      } else {
        add(counter::outbox_full);
      }
    }
  }
  end_queueing(slot);
  return true;
}

// Tracks it from now on. A message to everyone holds its slot until it was sent.
inline void direct_messages::begin(slot_id slot, const tracker& as) noexcept {
  take_outcomes(); // of the slot's former message
  assert(!trackers_.under_way(slot));
  trackers_.begin(slot, as);
  message_store_.track(slot, as.everyone);
}

// False, counted, when the peer's queue is full.
inline bool direct_messages::queue_to(peer_index to, slot_id slot) noexcept {
  const tracker& one = trackers_.at(slot);
  if (!outbox_.push_direct(to, one.priority, slot)) return false;
  if (!one.everyone) trackers_.charge(slot, to);
  return true;
}

// If it has no delivery, it is pending or has ended.
inline void direct_messages::end_queueing(slot_id slot) noexcept {
  if (!trackers_.at(slot).everyone) return message_store_.release(slot);
  if (slots_.references(slot) == 1) complete(slot, false);
}

// ---- requests and replies

status direct_messages::send_request(slot_id slot, peer_index to, detail::call_ref call,
                                     bool stops) noexcept {
  const slot_class of = slots_.class_of(slot);
  const bool has_slot = to || stops || trackers_.any_unclaimed(of);
  begin(slot, {.everyone = !to, .request_of = call});
  if (!has_slot) {
    add(counter::no_slot);
    return errc::full;
  }
  const bool may = !to || stops || trackers_.has_share(to, outbox_.of(to).backpressured(), of);
  if (to && may && !has_room(to, trackers_.at(slot).priority)) {
    add(counter::outbox_full);
    return errc::full;
  }
  if (to && (!may || !queue_to(to, slot))) return errc::full;
  end_queueing(slot);
  return {};
}

void direct_messages::track_reply(slot_id slot, const call_endpoint& sender, detail::call_ref own,
                                  detail::call_ref of) noexcept {
  take_outcomes(); // of the slot's former message
  trackers_.at(slot) = {.now = tracker::state::queued, .sender = sender, .own = own, .request_of = of};
  trackers_.at(slot).is_long = of.generation != 0;
  message_store_.track(slot, false);
}

void direct_messages::cancel(slot_ref which) noexcept {
  take_outcomes();
  if (!which.index || !slots_.alive(which) || !trackers_.under_way(which.index)) return;
  trackers_.at(which.index).sender = {};
  if (message_store_.cancel(which)) trackers_.forget(which.index);
}

// ---- outcomes

void direct_messages::complete_outcomes() noexcept {
  for (outcome what; message_store_.take_outcome(what);) {
    tracker& one = trackers_.at(what.slot);
    if (what.sent) {
      one.sent = true;
      // One peer is enough: the others may not read for a long time.
      local_delivery_.complete(std::exchange(one.sender, {}), one.own, {});
    }
    if (what.expired) {
      const tracker over = one;
      trackers_.forget(what.slot);
      local_delivery_.complete(over.sender, over.own, over.sent ? status{} : status{errc::expired});
    } else if (what.ended) {
      complete(what.slot, what.evicted);
    }
  }
}

// All deliveries of a message have ended, one way or the other.
inline void direct_messages::complete(slot_id slot, bool evicted) noexcept {
  const tracker& one = trackers_.at(slot);
  if (one.now == tracker::state::pending) return; // it is pending, with no delivery
  if (one.sent) return end(slot, {});
  if (state_.cycle.closing) return end(slot, errc::closed);
  if (!one.everyone) return end(slot, evicted ? errc::full : errc::peer_lost);
  if (slots_.expires(slot) <= state_.cycle.now) {
    add(counter::expired);
    return end(slot, errc::expired);
  }
  trackers_.wait(slot);
}

inline void direct_messages::end(slot_id slot, const status& outcome) noexcept {
  const tracker over = trackers_.at(slot);
  trackers_.forget(slot);
  if (slots_.pinned(slot)) message_store_.drop_pinned(slot);
  const auto ends = over.is_long ? state_.calls.note(over.request_of, slot, !!outcome) : call_index{};
  if (ends) state_.due.arm(ends, state_.cycle.now);
  local_delivery_.complete(over.sender, over.own, outcome);
}

// ---- pending messages

void direct_messages::deliver_pending(peer_index peer) noexcept {
  for (slot_id slot = trackers_.first_pending(); slot; slot = trackers_.first_pending()) {
    if (slots_.expires(slot) < state_.cycle.now) {
      message_store_.expire(slot);
      take_outcomes();
      continue;
    }
    tracker& one = trackers_.at(slot);
    if (!has_room(peer, one.priority)) return;
    trackers_.end_pending(slot);
    if (call* const asked = state_.calls.find(one.request_of)) {
      asked->callee = call_endpoint::of(state_.peers[peer].id, asked->callee.speaks);
      one.everyone = false;
    }
    (void)queue_to(peer, slot); // there is room
  }
}

// Looks only if something left a queue, or a slot was freed, since the last look: else no peer has got room.
void direct_messages::place_all_pending() noexcept {
  const std::uint64_t changes = outbox_.room_changes() + trackers_.began_to_wait();
  if (std::exchange(looked_for_room_at_, changes) == changes) return;
  for (const peer_index i : state_.peers.ids()) {
    if (pending() == 0) return;
    if (state_.peers[i].open() && state_.peers[i].takes_messages) deliver_pending(i);
  }
}

void direct_messages::close() noexcept {
  take_outcomes();
  while (pending() != 0) {
    add(counter::lost_at_close);
    end(trackers_.first_pending(), errc::closed);
  }
}

// ---- checks

// Each message under way has a tracked slot, unless its outcome is still to be taken.
bool direct_messages::check() const noexcept {
  if (!trackers_.check() || !parking_.check()) return false;
  for (const slot_id i : slots_.ids()) {
    if (trackers_.under_way(i) != (slots_.references(i) != 0 && slots_.tracked(i))) return false;
  }
  return true;
}

} // namespace rowe::service
