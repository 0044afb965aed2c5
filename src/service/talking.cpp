// SPDX-License-Identifier: Apache-2.0
// What lanes and threads at the front door say, and plain messages on their way out: how a letter finds its
// peers, waits for them, and ends.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <utility>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "service/shares.hpp"

namespace rowe::service {
namespace {

using detail::entry;

constexpr std::size_t entries_budget = 64; // taken from one lane, or from the front door, in one cycle

// The slot that was put aside after this one, in the header's room for outcomes, which only ends have.
std::int64_t& next_held(const detail::lane_slots& slots, std::uint32_t slot) noexcept {
  return slots.header(slot)->outcome_value;
}

party party_of_door(std::uint32_t slot) noexcept { return {.who = party::kind::door, .index = slot}; }

} // namespace

// ---- out of the lanes

// What has no room further on is put aside: a list through the slots' headers, which are ours until the slots
// go home. So one peer that does not read keeps nothing from the others, and nothing from being told that its
// time is over.
void core::take_entries(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  const bool receives = receiver() == index;
  if (receives) mark_taken();
  begin_turn(lanes_[index].user.out.count, receives);
  retry_entries(index);
  const std::size_t taken = take_new_entries(index);
  if (receives) collect_taken(taken);
  // How many of those for everyone wait here decides whether more are taken.
  detail::lane& lane = lanes_[index];
  const detail::audience now = refuses_to_everyone() ? detail::audience::crowded : detail::audience::somebody;
  // relaxed, both: ours alone; advice, which post() acts on
  if (lane.heard_by.load(std::memory_order_relaxed) != now) {
    lane.heard_by.store(now, std::memory_order_relaxed);
    view.gave = true;
  }
  // acquire: pairs with the release in ask_room()
  lanes_ask_room_ = lanes_ask_room_ || lane.room_asked.load(std::memory_order_acquire) != 0;
}

std::size_t core::take_new_entries(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  const detail::emptying_end& path = lanes_[index].service.out;
  for (std::size_t left = entries_budget; left > 0; --left) {
    const auto slot = path.out->try_pop();
    if (!slot) return entries_budget - left;
    if (take_entry(index, *slot)) {
      path.home->give(*slot);
      view.gave = true;
      continue;
    }
    next_held(path.slots, *slot) = no_index;
    if (view.held_first == no_index) {
      view.held_first = *slot;
    } else {
      next_held(path.slots, view.held_last) = *slot;
    }
    view.held_last = *slot;
  }
  lanes_left_ = true;
  return entries_budget;
}

// Those put aside, in their order, as if they came now.
void core::retry_entries(std::uint32_t index) noexcept {
  turn_retries_ = true;
  lane_view& view = views_[index];
  const detail::emptying_end& path = lanes_[index].service.out;
  std::uint32_t before = no_index;
  for (std::uint32_t slot = view.held_first; slot != no_index;) {
    const std::int64_t next = next_held(path.slots, slot);
    if (take_entry(index, slot)) {
      path.home->give(slot);
      view.gave = true;
      ++places_freed_;
      if (before == no_index) {
        view.held_first = static_cast<std::uint32_t>(next);
      } else {
        next_held(path.slots, before) = next;
      }
    } else {
      before = slot;
    }
    slot = static_cast<std::uint32_t>(next);
  }
  view.held_last = before;
  turn_retries_ = false;
}

// False when it must wait for room further on.
bool core::take_entry(std::uint32_t index, std::uint32_t slot) noexcept {
  const detail::lane& lane = lanes_[index];
  const detail::value_header& header = *lane.service.out.slots.header(slot);
  const std::byte* const value = lane.service.out.slots.value(slot);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const party us{.who = party::kind::lane, .index = index, .generation = views_[index].generation};
  const party waits = header.own.generation != 0 ? us : party{};
  switch (header.what) {
  case entry::message:
    return post_in_turn({.text = text,
                         .sender = waits,
                         .own = header.own,
                         .to = header.peer,
                         .only_now = header.expires_ns == header.stamped_ns,
                         .expires = time_of(header.expires_ns),
                         .priority = lane.priority});
  case entry::invocation: {
    asking what{.is = asking::form::object, .text = text, .to = header.peer};
    if (lane.kind == detail::lane_kind::call_text) what.is = asking::form::args;
    if (lane.kind == detail::lane_kind::call_value)
      what = {.is = asking::form::value, .encoder = lane.encoder, .value = value, .to = header.peer};
    start_call(us, header.own, lane.name(), what, time_of(header.stamped_ns), time_of(header.expires_ns));
    return true;
  }
  case entry::reply:
  case entry::refusal: {
    phases_.answered(time_of(header.stamped_ns));
    const status done =
        header.what == entry::refusal
            ? refuse_call(us, header.call, text)
            : answer_call(us, header.call,
                          {.text = text,
                           .encoder = lane.encoder,
                           .value = value,
                           .expires = expiry_of(time_of(header.stamped_ns), time_of(header.expires_ns)),
                           .waits = waits,
                           .own = header.own});
    if (!done) tell(waits, header.own, done);
    return true;
  }
  case entry::end: break; // only ever comes the other way
  }
  return true;
}

// ---- out of the front door

// What has no room further on is put aside, as in a lane; here it would stand in other threads' way, too.
void core::take_from_door() noexcept {
  const std::uint64_t expired = door_.expired();
  add(counter::inbound_expired, expired - std::exchange(door_expired_, expired));
  const bool receives = receiver() == no_index;
  if (receives) mark_taken();
  begin_turn(door_.slots(), receives);
  retry_door();
  const std::size_t taken = door_.take(
      [&](std::uint32_t slot) {
        if (!take_door_slot(slot)) door_held_[door_held_count_++] = slot; // there is a place for each
      },
      entries_budget);
  lanes_left_ = lanes_left_ || taken == entries_budget;
  if (receives) collect_taken(taken);
  if (door_.refuse_to_everyone(refuses_to_everyone())) room_came_ = true;
}

void core::retry_door() noexcept {
  turn_retries_ = true;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < door_held_count_; ++i) {
    const std::uint32_t slot = door_held_[i];
    if (!take_door_slot(slot)) door_held_[kept++] = slot;
  }
  places_freed_ += door_held_count_ - kept;
  door_held_count_ = kept;
  turn_retries_ = false;
}

bool core::take_door_slot(std::uint32_t slot) noexcept {
  const door_header asked = door_.request(slot); // a copy: once it is settled the slot may be another's
  const std::string_view text = door_.request_text(slot);
  const party us = party_of_door(slot);
  switch (asked.what) {
  case door_request::message: {
    const bool taken = post_in_turn({.text = text,
                                     .sender = asked.wants_outcome ? us : party{},
                                     .to = asked.peer,
                                     .only_now = asked.expires == asked.stamped,
                                     .expires = asked.expires});
    if (taken && !asked.wants_outcome) door_.settle(slot, {});
    return taken;
  }
  case door_request::invocation:
    start_call(us, {}, {}, {.is = asking::form::object, .text = text, .to = asked.peer}, asked.stamped,
               asked.expires);
    return true;
  case door_request::reply:
  case door_request::refusal: {
    const party waits = asked.wants_outcome ? us : party{};
    const status done =
        asked.what == door_request::refusal
            ? refuse_call(us, asked.call, text)
            : answer_call(us, asked.call,
                          {.text = text, .expires = expiry_of(asked.stamped, asked.expires), .waits = waits});
    if (!done || !asked.wants_outcome || asked.what == door_request::refusal) door_.settle(slot, done);
    return true;
  }
  }
  return true;
}

// ---- what is put aside
//
// It keeps a slot of the sender's. What is for one peer may have as many of them as nobody has, and all
// together three quarters; so whatever is for others finds one. Of whoever receives it may have all: what is
// taken from peers is limited there, so that each answer finds room. From then on senders are told `full`
// before they take a slot, until nothing waits for that peer any more; what was under way by then ends so.
// What is for everyone waits whole, since its sender counts on that; but its sender is told `full` as soon.

void core::begin_turn(std::uint32_t slots, bool of_receiver) noexcept {
  ++turn_;
  turn_slots_ = of_receiver ? slots : slots - slots / 4;
  turn_held_ = turn_held_for_all_ = 0;
  turn_of_receiver_ = of_receiver;
  if (!of_receiver || std::exchange(answers_held_, 0) == 0) return;
  for (connection& c : peers_) c.answers_held = 0;
}

bool core::refuses_to_everyone() const noexcept {
  return turn_held_for_all_ != 0 && turn_held_for_all_ + turn_held_ >= turn_slots_;
}

// Null: for everyone. False where the peer has its share of the slots already. Asked in each turn for what
// was put aside before, too, which stays whatever the shares are by now.
bool core::put_aside(connection* to) noexcept {
  if (to == nullptr) {
    ++turn_held_;
    ++turn_held_for_all_;
    return true;
  }
  if (std::exchange(to->held_in, turn_) != turn_) to->held_count = 0;
  if (!turn_retries_ && to->held_count + turn_held_ >= turn_slots_) return false;
  ++to->held_count;
  ++turn_held_;
  if (turn_of_receiver_) {
    ++to->answers_held;
    ++answers_held_;
  }
  if (to->held_count + turn_held_ >= turn_slots_ && !std::exchange(to->told_full, true)) {
    ++told_full_;
    shown_.set_taking(to->id.index, 0);
  }
  return true;
}

// At the end of a cycle: who waits for room is told where it came.
void core::tell_of_room() noexcept {
  if (told_full_ != 0) {
    for (connection& c : peers_) {
      if (!c.told_full || c.held_in > cycle_turn_) continue;
      c.told_full = false;
      --told_full_;
      shown_.set_taking(c.id.index, c.id.generation);
      ++places_freed_;
      room_came_ = true;
    }
  }
  const bool came = std::exchange(room_came_, false);
  if (came) door_.tell_room();
  if (!std::exchange(lanes_ask_room_, false)) return;
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    lane_view& view = views_[i];
    if (!view.attached || lanes_[i].kind != detail::lane_kind::talk) continue;
    // acquire: pairs with the release in ask_room()
    const std::uint32_t asked = lanes_[i].room_asked.load(std::memory_order_acquire);
    const bool look = asked != view.room_asked || view.gave || came;
    view.room_asked = asked;
    view.gave = false;
    if (asked != 0 && look) lanes_[i].news.notify();
  }
}

// ---- letters

// What a user wrote is one JSON object without the members that are ours.
status core::check_text(std::string_view text) noexcept {
  if (const status valid = validator_.validate(text); !valid) return valid;
  if (!json::is_object(text)) return errc::not_an_object;
  if (const auto at = wire::bare::find_reserved(text))
    return error{errc::reserved_member, static_cast<std::int64_t>(*at)};
  return {};
}

// Messages that are over make room: their outcomes are taken at once, for they had slots.
bool core::has_room(connection& c, priority at) noexcept {
  const bool has = outbox_.has_room({c.id.index}, at);
  take_outcomes();
  return has;
}

// A message waits where it is while no peer that it may go to has room, so that its sender finds the lane
// full instead of losing something; and behind those that wait for room already. Among several peers one that
// does not read must not stop the others.
bool core::has_room_for(const message& m) noexcept {
  if (m.to.generation != 0) {
    connection& to = peers_[peer_index{m.to.index}];
    return has_room(to, m.priority) &&
           letters_.has_share(m.to.index, queues_of(to).backpressured(), slots_.class_for(m.text.size()));
  }
  bool any = false;
  for (connection& c : peers_) {
    if (!c.open() || !c.bare) continue;
    if (letters_.waiting() == 0 && c.held_in != turn_ && has_room(c, m.priority)) return true;
    any = true;
  }
  // A quarter of the slots is never taken by what waits for a peer to come.
  return !any && letters_.waiting() < slots_.count() - slots_.count() / 4;
}

// post(), in the turn of one lane or of the front door: false also behind one that waits already and was for
// the same peer, or for everyone. So each peer gets what one sender has for it in its order.
bool core::post_in_turn(const message& m) noexcept {
  connection* const to = find({m.to.index, m.to.generation}); // null: everyone, or gone
  const bool gone = to == nullptr && m.to.generation != 0;
  const bool behind = all_held_in_ == turn_ || (to != nullptr && to->held_in == turn_);
  if (behind && !gone && !closing_ && (m.only_now || m.expires >= now_)) {
    if (!m.only_now && put_aside(to)) return false;
    add(counter::outbox_full);
    tell(m.sender, m.own, m.only_now ? errc::expired : errc::full);
    return true;
  }
  if (post(m)) return true;
  // A peer has no room, or no slot. Or nobody has, and then no later one may pass.
  if (to == nullptr) all_held_in_ = turn_;
  if (put_aside(to)) return false;
  add(counter::outbox_full);
  tell(m.sender, m.own, errc::full);
  return true;
}

// False when it must wait for room. Else its sender is told what comes of it, at once or later.
bool core::post(const message& m) noexcept {
  const auto fails = [&](const status& why, counter as) {
    add(as);
    tell(m.sender, m.own, why);
    return true;
  };
  if (closing_) return fails(errc::closed, counter::lost_at_close);
  // Only now: in the cycle that takes it, however long it has lain in its lane.
  const rt::time_point expires = m.only_now ? now_ : m.expires;
  if (expires < now_) return fails(errc::expired, counter::expired);
  if (m.to.generation != 0) {
    const connection* const to = find({m.to.index, m.to.generation});
    if (to == nullptr || !to->open()) return fails(errc::peer_lost, counter::lost_with_peer);
  }
  if (m.text.size() > outbox_.text_bytes_max()) {
    return fails(error{errc::too_big, static_cast<std::int64_t>(m.text.size()),
                       static_cast<std::int64_t>(outbox_.text_bytes_max())},
                 counter::too_big);
  }
  if (!has_room_for(m)) return m.only_now ? fails(errc::expired, counter::outbox_full) : false;
  const slot_class of = slots_.class_for(m.text.size());
  // What topics and answers have taken of these is evicted for it.
  if (letters_.slots_left(of) == 0) return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  // Last, since what waits for room comes by here in every cycle.
  if (const status fine = check_text(m.text); !fine) {
    return fails(fine, fine.code() == errc::too_big ? counter::too_big : counter::malformed);
  }
  if (slots_.free_for_all(of) == 0 && !outbox_.evict_for(of))
    return m.only_now ? fails(errc::expired, counter::no_slot) : false;
  const std::uint32_t slot = compose(expires, [&](json::writer& into) { into.append(m.text); });
  assert(slot != no_index);
  begin_letter(slot,
               {.priority = m.priority, .everyone = m.to.generation == 0, .sender = m.sender, .own = m.own});
  if (m.to.generation != 0) {
    (void)queue_letter(peers_[peer_index{m.to.index}], slot); // has_room_for() said so
  } else {
    for (connection& c : peers_) {
      if (!c.open() || !c.bare) continue;
      if (c.held_in == turn_) {
        add(counter::outbox_full); // it comes behind what waits for room there
      } else {
        (void)queue_letter(c, slot); // what finds no room is counted
      }
    }
  }
  send_letter(slot);
  return true;
}

// Tracked from now on. One that may go to any peer keeps its slot until it was sent.
void core::begin_letter(std::uint32_t slot, const letter& as) noexcept {
  take_outcomes(); // of who had the slot before
  assert(!letters_.under_way(slot));
  letters_.begin(slot, as);
  outbox_.track(slot, as.everyone);
}

// Behind the queueing: with no delivery it waits for a peer, or is over.
void core::send_letter(std::uint32_t slot) noexcept {
  if (!letters_.at(slot).everyone) return outbox_.release(slot);
  if (slots_.references(slot) == 1) settle_letter(slot, false);
}

// False, counted, when the peer's queue is full.
bool core::queue_letter(connection& c, std::uint32_t slot) noexcept {
  if (!outbox_.push_direct({c.id.index}, letters_.at(slot).priority, slot)) return false;
  if (!letters_.at(slot).everyone) letters_.charge(slot, c.id.index);
  return true;
}

// What became of messages since the last look.
void core::settle_outcomes() noexcept {
  for (outcome what; outbox_.take_outcome(what);) {
    letter& l = letters_.at(what.slot);
    if (what.sent) {
      l.sent = true;
      tell(std::exchange(l.sender, {}), l.own, {}); // one peer is enough: the others may not read for long
    }
    if (what.expired) {
      const letter over = l;
      letters_.forget(what.slot);
      tell(over.sender, over.own, over.sent ? status{} : status{errc::expired});
    } else if (what.ended) {
      settle_letter(what.slot, what.evicted);
    }
  }
}

// All deliveries of a letter have ended, one way or the other.
void core::settle_letter(std::uint32_t slot, bool evicted) noexcept {
  letter& l = letters_.at(slot);
  if (l.now == letter::state::waiting) return; // it has none yet
  if (l.sent) return end_letter(slot, {});
  if (closing_) return end_letter(slot, errc::closed);
  if (!l.everyone) return end_letter(slot, evicted ? errc::full : errc::peer_lost);
  if (slots_.expires(slot) <= now_) {
    add(counter::expired);
    return end_letter(slot, errc::expired);
  }
  letters_.wait(slot);
}

void core::end_letter(std::uint32_t slot, const status& outcome) noexcept {
  const letter over = letters_.at(slot);
  letters_.forget(slot);
  if (slots_.kept(slot)) outbox_.let_go(slot);
  tell(over.sender, over.own, outcome);
}

// The request of a call that has ended is not sent any more, unless a socket is in the middle of it.
void core::cancel_letter(slot_ref which) noexcept {
  take_outcomes();
  if (which.index == no_index || !slots_.alive(which) || !letters_.under_way(which.index)) return;
  letters_.at(which.index).sender = {};
  if (outbox_.cancel(which)) letters_.forget(which.index);
}

// Gives waiting letters to a peer, in their order, as far as it has room: it has come, or another one left
// before it was given them. The rest goes on waiting. A request goes to the first who has room.
void core::welcome(connection& c) noexcept {
  for (std::uint32_t slot = letters_.first_waiting(); slot != no_index; slot = letters_.first_waiting()) {
    if (slots_.expires(slot) < now_) {
      outbox_.expire(slot);
      take_outcomes();
      continue;
    }
    letter& l = letters_.at(slot);
    if (!has_room(c, l.priority)) return;
    letters_.stop_waiting(slot);
    if (call* const asked = calls_.find(l.request_of)) {
      asked->provider = party::of(c.id, asked->provider.speaks);
      l.everyone = false;
    }
    (void)queue_letter(c, slot); // there is room
  }
}

// Letters wait although there are peers where those had no room, or another one left with them. Nobody has
// got room since the last look if nothing was taken out of any queue and no slot became free.
void core::place_waiting() noexcept {
  const std::uint64_t changes = outbox_.entries().popped() + slots_.freed() + letters_.began_to_wait();
  if (letters_.waiting() == 0 || std::exchange(looked_for_room_at_, changes) == changes) return;
  for (connection& c : peers_) {
    if (letters_.waiting() == 0) return;
    if (c.open() && c.bare) welcome(c);
  }
}

} // namespace rowe::service
