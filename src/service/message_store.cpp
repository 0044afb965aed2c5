// SPDX-License-Identifier: Apache-2.0
#include "service/message_store.hpp"

#include <algorithm>
#include <cassert>

#include "wire/websocket.hpp"

namespace rowe::service {
namespace {

// A slot whose time is over and that a socket has the beginning of is looked at again after this.
constexpr rt::duration partial_look_period = std::chrono::milliseconds{10};

// The wheel reports what is over, so behind the last moment at which it is not.
rt::time_point over_at(rt::time_point expires) noexcept { return expires + rt::duration{1}; }

} // namespace

std::size_t message_store::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return wire_slots::footprint_bytes(bounds) + arena::bytes_for<std::uint32_t>(wire_slots::count(bounds)) +
         arena::bytes_for<tracking>(wire_slots::count(bounds));
}

message_store::message_store(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : text_bytes_max_{std::min(parts.text_bytes_max, wire_slots::large_bytes(bounds))},
      cycle_{parts.cycle},
      counts_{parts.counts},
      due_{parts.due},
      slots_{memory, bounds},
      unarmed_{memory.carve<std::uint32_t>(wire_slots::count(bounds))},
      tracked_{memory.carve<tracking>(wire_slots::count(bounds))} {}

// The frame header goes in front of the text. The wheel learns when it ends at the end of the cycle, if it is
// still there.
void message_store::finalize(std::uint32_t slot, std::size_t bytes, rt::time_point expires) noexcept {
  slots_.finish(slot, bytes, expires);
  cycle_.work_bytes += bytes;
  (void)wire::write_frame_header_before(reinterpret_cast<std::byte*>(slots_.text(slot).data()),
                                        wire::opcode::text,
                                        bytes); // where it starts follows from `bytes`
  if (expires == rt::never) return;
  if (expires == cycle_.now) lives_no_longer_ = true;
  if (unarmed_count_ == unarmed_.size()) return due_.arm(slot_id{slot}, over_at(expires));
  unarmed_[unarmed_count_++] = slot;
}

void message_store::arm_all_unwritten() noexcept {
  for (const std::uint32_t slot : unarmed_.first(std::exchange(unarmed_count_, 0))) {
    // One that was freed and is another message's by now is there twice, which does no harm.
    const rt::time_point expires = slots_.expires(slot);
    if (slots_.references(slot) != 0 && expires != rt::never) due_.arm(slot_id{slot}, over_at(expires));
  }
}

// The clock decides; the wheel only noticed.
void message_store::expire(std::uint32_t slot) noexcept {
  const slot_id which{slot};
  if (slots_.expires(slot) >= cycle_.now) return due_.arm(which, over_at(slots_.expires(slot)));
  const bool tracked = slots_.tracked(slot);
  const bool kept = slots_.kept(slot);
  const auto deliveries = slots_.expire(slot);
  // In the middle of being written: it goes when the socket has it all, or with its connection.
  if (!deliveries) return due_.arm(which, cycle_.now + partial_look_period);
  due_.disarm(which);
  const bool waited = kept && *deliveries == 0;
  counts_.add(counter::expired, *deliveries + (waited ? 1 : 0));
  if (tracked) note(slot).expired = true;
}

// ---- tracking

void message_store::track(std::uint32_t slot, bool keeps) noexcept {
  assert(!tracked_[slot_id{slot}].listed);
  slots_.track(slot, keeps);
}

bool message_store::cancel(slot_ref which) noexcept {
  if (which.index == no_index || !slots_.alive(which)) return false;
  if (!slots_.expire(which.index)) return false;
  due_.disarm(slot_id{which.index});
  return true;
}

void message_store::let_go(std::uint32_t slot) noexcept {
  slots_.untrack(slot);
  release(slot);
}

void message_store::note_tracked_sent(std::uint32_t slot) noexcept {
  tracking& one = note(slot);
  one.sent = true;
  if (slots_.kept(slot)) slots_.unkeep(slot); // never the last reference: the socket's is still there
}

bool message_store::take_outcome(outcome& into) noexcept {
  if (outcomes_.empty()) return false;
  const slot_id which = outcomes_.pop_front(tracked_);
  const tracking one = std::exchange(tracked_[which], {});
  into = {.slot = which.value,
          .sent = one.sent,
          .ended = one.ended,
          .evicted = one.evicted,
          .expired = one.expired};
  return true;
}

// ---- for tests

bool message_store::check() const noexcept {
  if (!slots_.check()) return false;
  for (std::uint32_t i = 0; i < slots_.count(); ++i) {
    if (slots_.references(i) != 0 && slots_.kept(i) && !slots_.tracked(i)) return false;
  }
  return true;
}

} // namespace rowe::service
