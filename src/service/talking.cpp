// SPDX-License-Identifier: Apache-2.0
// What lanes and threads at the front door say.
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
  const bool receives = receiver_.pair() == index;
  if (receives) receiver_.mark_home();
  messages_.begin_turn(lanes_[index].user.out.count, receives);
  if (view.held_first != no_index) retry_entries(index);
  const std::size_t taken = take_new_entries(index);
  if (receives) receiver_.count_home(taken);
  // How many of those for everyone wait here decides whether more are taken.
  detail::lane& lane = lanes_[index];
  const detail::audience now =
      messages_.refuses_to_everyone() ? detail::audience::crowded : detail::audience::somebody;
  if (lane.audience.advice() != now) {
    lane.audience.set(now);
    view.gave = true;
  }
  // acquire: pairs with the release in ask_room()
  lanes_ask_room_ = lanes_ask_room_ || lane.room_asked.load(std::memory_order_acquire) != 0;
}

inline std::size_t core::take_new_entries(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  const detail::emptying_end& path = lanes_[index].service.out;
  for (std::size_t left = entries_budget; left > 0; --left) {
    const auto slot = path.out->try_pop();
    if (!slot) return entries_budget - left;
    if (take_entry(index, *slot, false)) {
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
  lane_view& view = views_[index];
  const detail::emptying_end& path = lanes_[index].service.out;
  std::uint32_t before = no_index;
  for (std::uint32_t slot = view.held_first; slot != no_index;) {
    const std::int64_t next = next_held(path.slots, slot);
    if (take_entry(index, slot, true)) {
      path.home->give(slot);
      view.gave = true;
      ++cycle_.places_freed;
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
}

// False when it must wait for room further on.
inline bool core::take_entry(std::uint32_t index, std::uint32_t slot, bool parked) noexcept {
  const detail::lane& lane = lanes_[index];
  const detail::value_header& header = *lane.service.out.slots.header(slot);
  const std::byte* const value = lane.service.out.slots.value(slot);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const party us{.who = party::kind::lane, .index = index, .generation = views_[index].generation};
  const party waits = header.own.generation != 0 ? us : party{};
  switch (header.what) {
  case entry::message:
    return messages_.post({.text = text,
                           .sender = waits,
                           .own = header.own,
                           .to = header.peer,
                           .only_now = header.expires_ns == header.stamped_ns,
                           .parked = parked,
                           .expires = time_of(header.expires_ns),
                           .priority = lane.priority});
  case entry::invocation: {
    wire::call_args what{.is = wire::call_args::form::object, .text = text};
    if (lane.kind == detail::lane_kind::call_text) what.is = wire::call_args::form::args;
    if (lane.kind == detail::lane_kind::call_value)
      what = {.is = wire::call_args::form::value, .encoder = lane.encoder, .value = value};
    start_call(us, header.own, lane.name(), what, header.peer, time_of(header.stamped_ns),
               time_of(header.expires_ns));
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
  const bool receives = receiver_.pair() == no_index;
  if (receives) receiver_.mark_home();
  messages_.begin_turn(door_.slots(), receives);
  if (door_held_count_ != 0) retry_door();
  const std::size_t taken = door_.take(
      [&](std::uint32_t slot) {
        if (!take_door_slot(slot, false)) door_held_[door_held_count_++] = slot; // there is a place for each
      },
      entries_budget);
  lanes_left_ = lanes_left_ || taken == entries_budget;
  if (receives) receiver_.count_home(taken);
  if (door_.refuse_to_everyone(messages_.refuses_to_everyone())) room_came_ = true;
}

void core::retry_door() noexcept {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < door_held_count_; ++i) {
    const std::uint32_t slot = door_held_[i];
    if (!take_door_slot(slot, true)) door_held_[kept++] = slot;
  }
  cycle_.places_freed += door_held_count_ - kept;
  door_held_count_ = kept;
}

bool core::take_door_slot(std::uint32_t slot, bool parked) noexcept {
  const door_header asked = door_.request(slot); // a copy: once it is settled the slot may be another's
  const std::string_view text = door_.request_text(slot);
  const party us = party_of_door(slot);
  switch (asked.what) {
  case door_request::message: {
    const bool taken = messages_.post({.text = text,
                                       .sender = asked.wants_outcome ? us : party{},
                                       .to = asked.peer,
                                       .only_now = asked.expires == asked.stamped,
                                       .parked = parked,
                                       .expires = asked.expires});
    if (taken && !asked.wants_outcome) door_.settle(slot, {});
    return taken;
  }
  case door_request::invocation:
    start_call(us, {}, {}, {.is = wire::call_args::form::object, .text = text}, asked.peer, asked.stamped,
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

// At the end of a cycle: who waits for room is told where it came.
void core::tell_of_room() noexcept {
  const bool peers_have = messages_.renew_room();
  const bool came = std::exchange(room_came_, false) || peers_have;
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

rt::time_point core::inbound_expiry(std::int64_t ttl_ns) const noexcept {
  const rt::time_point by_peer = rt::deadline_after(now_, rt::duration{ttl_ns}); // negative: never
  return std::min(by_peer, rt::deadline_after(now_, options_.inbound_ttl));
}

} // namespace rowe::service
