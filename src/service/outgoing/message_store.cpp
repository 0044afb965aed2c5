// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/message_store.hpp"

#include <algorithm>
#include <cstring>

#include "service/base/service_limits.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {
namespace {

// When the wheel must report a message: just after the last moment at which it has not expired.
rt::time_point over_at(rt::time_point expires) noexcept { return expires + rt::duration{1}; }

} // namespace

std::size_t message_store::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return slot_pool::footprint_bytes(bounds) + arena::bytes_for<slot_id>(slot_pool::count(bounds)) +
         arena::bytes_for<tracking>(slot_pool::count(bounds));
}

message_store::message_store(rt::arena& memory, core_state& state) noexcept
    : state_{state},
      text_bytes_max_{
          std::min(state.seams.protocols.message_bytes_max, slot_pool::large_bytes(state.bounds()))},
      slots_{memory, state_.chunks, state_.bounds()},
      unarmed_{memory.carve<slot_id>(slot_pool::count(state_.bounds()))},
      tracked_{memory.carve<tracking>(slot_pool::count(state_.bounds()))} {}

inline void message_store::watch_expiry(slot_id slot, rt::time_point expires) noexcept {
  if (expires == rt::never) return;
  if (expires == state_.cycle.now) expires_this_cycle_ = true;
  if (unarmed_count_ == unarmed_.size()) return state_.due.arm(slot, over_at(expires));
  unarmed_[unarmed_count_++] = slot;
}

// Writes the frame header before the text. The wheel is armed at the end of the cycle, if the message is
// still there then.
void message_store::finalize(slot_id slot, std::size_t bytes, const message_lifetime& lifetime,
                             bool binary) noexcept {
  slots_.finish(slot, bytes, lifetime, binary);
  state_.cycle.work_bytes += bytes;
  (void)wire::write_frame_header_before(reinterpret_cast<std::byte*>(slots_.text(slot).data()),
                                        binary ? wire::opcode::binary : wire::opcode::text,
                                        bytes); // its start follows from `bytes`
  watch_expiry(slot, lifetime.expires);
}

void message_store::finalize_chunked(slot_id slot, std::size_t bytes,
                                     const message_lifetime& lifetime) noexcept {
  slots_.finish(slot, bytes, lifetime);
  watch_expiry(slot, lifetime.expires);
}

// The text of the slot leaves the place of the stand-in to the value. False: nobody knows that place.
bool message_store::leave_place(slot_id slot, std::string_view text, const long_value& value,
                                wire::message_kind kind) noexcept {
  const auto place = find_stand_in(text, value.stand_in);
  if (!place) return false;
  const std::span<char> into = slots_.buffer(slot, slot_class::chunked);
  const std::string_view rest = text.substr(place->at + place->bytes);
  std::memmove(into.data() + place->at, rest.data(), rest.size());
  slots_.finish(slot, place->at + rest.size(), {}, kind == wire::message_kind::binary);
  slots_.mark_chunks(slot, place->at, {});
  return true;
}

void message_store::arm_all_unwritten() noexcept {
  for (const slot_id slot : unarmed_.first(std::exchange(unarmed_count_, 0))) {
    // A slot that was freed and taken again is on the list twice. That does no harm.
    const rt::time_point expires = slots_.expires(slot);
    if (slots_.references(slot) != 0 && expires != rt::never) state_.due.arm(slot, over_at(expires));
  }
}

// The time decides what has expired; the wheel is only a reminder.
void message_store::expire(slot_id slot) noexcept {
  const slot_id which{slot};
  if (slots_.expires(slot) >= state_.cycle.now) return state_.due.arm(which, over_at(slots_.expires(slot)));
  const bool tracked = slots_.tracked(slot);
  const bool pinned = slots_.pinned(slot);
  const auto deliveries = slots_.expire(slot);
  // It is partly written. Its slot is freed when the socket has all of it, or when the peer leaves.
  if (!deliveries) return state_.due.arm(which, state_.cycle.now + partial_look_period);
  state_.due.disarm(which);
  const bool waited = pinned && *deliveries == 0;
  state_.counts.add(counter::expired, *deliveries + (waited ? 1 : 0));
  if (tracked) note(slot).expired = true;
}

// ---- tracking

void message_store::track(slot_id slot, bool pins) noexcept {
  assert(!tracked_[slot].listed);
  slots_.track(slot, pins);
}

bool message_store::cancel(slot_ref which) noexcept {
  if (!which.index || !slots_.alive(which)) return false;
  if (!slots_.expire(which.index)) return false;
  state_.due.disarm(which.index);
  return true;
}

void message_store::drop_pinned(slot_id slot) noexcept {
  slots_.untrack(slot);
  release(slot);
}

void message_store::note_tracked_sent(slot_id slot) noexcept {
  tracking& one = note(slot);
  one.sent = true;
  if (slots_.pinned(slot)) slots_.unpin(slot); // never the last reference: the delivery still has its own
}

bool message_store::take_outcome(outcome& into) noexcept {
  if (outcomes_.empty()) return false;
  const slot_id which = outcomes_.pop_front(tracked_);
  const tracking one = std::exchange(tracked_[which], {});
  into = {.slot = {which.value},
          .sent = one.sent,
          .ended = one.ended,
          .evicted = one.evicted,
          .expired = one.expired};
  return true;
}

// ---- checks

bool message_store::check() const noexcept {
  if (!slots_.check()) return false;
  for (const slot_id i : slots_.ids()) {
    if (slots_.references(i) != 0 && slots_.pinned(i) && !slots_.tracked(i)) return false;
  }
  return true;
}

} // namespace rowe::service
