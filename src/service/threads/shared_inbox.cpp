// SPDX-License-Identifier: Apache-2.0
#include "service/threads/shared_inbox.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <type_traits>
#include <vector>

namespace rowe::service {

std::size_t shared_inbox::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  const std::uint32_t slots = bounds.door_slots;
  return arena::bytes_for(rt::slab::bytes_for(slots, bounds.door_slot_bytes)) +
         arena::bytes_for<slot_state>(slots) + number_queue::footprint_bytes(slots) +
         arena::bytes_for<number>(std::bit_ceil(slots)) + arena::bytes_for<std::uint32_t>(slots);
}

shared_inbox::shared_inbox(rt::arena& memory, const limits& bounds) noexcept
    : texts_{memory.carve_bytes(rt::slab::bytes_for(bounds.door_slots, bounds.door_slot_bytes)),
             bounds.door_slots, bounds.door_slot_bytes},
      slots_{memory.carve<slot_state>(bounds.door_slots)},
      released_{memory, bounds.door_slots},
      places_{memory.carve<number>(std::bit_ceil(bounds.door_slots))},
      free_{memory.carve<std::uint32_t>(bounds.door_slots)} {
  static_assert(std::is_trivially_destructible_v<shared_inbox>);
  assert(free_.size() == bounds.door_slots); // footprint_bytes() is the sum
}

// ---- Any thread.
//
// The ring has a place for every slot, so it is never full. A thread reads a number from its place *before*
// it claims the entry. If the claim succeeds, the place held that number all the time. To write the place
// again, the service thread needs one number more than there are slots, so one slot was taken out and
// released in between. Entries are claimed in order, so another thread had claimed the entry by then, and the
// claim of this thread fails.

bool shared_inbox::pop(std::uint32_t& slot) noexcept {
  // acquire: pairs with the release of whoever claimed the entry before, so that the tail is not behind
  std::uint64_t head = head_.load(std::memory_order_acquire);
  // seq_cst: acquires what deliver() wrote; and stands after the sleeper's addition to sleepers_
  while (head != tail_.load(std::memory_order_seq_cst)) {
    // relaxed: ordered by the tail, which deliver() releases afterwards
    const std::uint32_t entry = places_[head & (places_.size() - 1)].load(std::memory_order_relaxed);
    // acq_rel, acquire: pair with each other, as above
    if (head_.compare_exchange_weak(head, head + 1, std::memory_order_acq_rel, std::memory_order_acquire)) {
      slot = entry;
      return true;
    }
  }
  return false;
}

bool shared_inbox::pop_unexpired(std::uint32_t& slot, rt::time_point now) noexcept {
  while (pop(slot)) {
    if (slots_[slot].header.expires > now) return true;
    drop(slot);
  }
  return false;
}

void shared_inbox::drop(std::uint32_t slot) noexcept {
  released_.put(slot);
  // relaxed: a number and no more; pairs with the load in expired()
  expired_.fetch_add(1, std::memory_order_relaxed);
}

void shared_inbox::note_receiver() noexcept {
  // relaxed, both: advice; pairs with has_receiver()
  if (!has_receiver_.load(std::memory_order_relaxed)) has_receiver_.store(true, std::memory_order_relaxed);
}

result<std::uint32_t> shared_inbox::try_receive(rt::time_point now) noexcept {
  note_receiver();
  std::uint32_t slot = 0;
  const bool closed = is_closed(); // first: what was delivered before is then found
  if (pop_unexpired(slot, now)) return slot;
  return closed ? errc::closed : errc::empty;
}

// No wake-up is lost. After it has moved the tail, the service thread looks for sleepers. If it sees one, it
// changes the count. Then the sleeper has not read the count yet, and will see the tail; or the kernel's
// comparison keeps it from sleeping; or it is woken. If it sees none, it moved the tail before the sleeper
// added itself, and the sleeper looks at the tail after that. (Four seq_cst accesses; close() does as
// deliver().)
result<std::uint32_t> shared_inbox::receive(rt::time_point deadline) noexcept {
  note_receiver();
  std::uint32_t slot = 0;
  if (pop_unexpired(slot, rt::monotonic_clock::now())) return slot;
  sleepers_.fetch_add(1, std::memory_order_seq_cst);
  errc why = errc::timed_out;
  bool found = false;
  for (bool in_time = true;;) {
    // acquire: pairs with the exchange in wake_receiver()
    const std::uint32_t seen = wake_count_.load(std::memory_order_acquire);
    const bool closed = is_closed();
    found = pop_unexpired(slot, rt::monotonic_clock::now());
    if (closed) why = errc::closed;
    if (found || closed || !in_time) break;
    in_time = rt::futex::wait(wake_count_, seen, deadline);
  }
  sleepers_.fetch_sub(1, std::memory_order_seq_cst);
  if (why == errc::closed)
    rt::futex::wake(wake_count_); // a wake reaches one sleeper, so this one passes it on
  if (found) return slot;
  return why;
}

// No wake-up is lost: the exchanges have one order. So either the service thread finds the slot when it
// collects, or this exchange finds that it has asked.
bool shared_inbox::release(std::uint32_t slot) noexcept {
  released_.put(slot);
  // acq_rel: pairs with the exchange in ask_for_slots()
  return slots_wanted_.exchange(0, std::memory_order_acq_rel) != 0;
}

// Changes the count and wakes one sleeper, if there is any. The count is even after a delivery and odd after
// closing. It never becomes what a sleeper has read: a value comes again only after 2^31 deliveries.
void shared_inbox::wake_receiver(std::uint32_t count) noexcept {
  if (sleepers_.load(std::memory_order_seq_cst) == 0) return;
  // release: pairs with the acquire in receive()
  wake_count_.exchange(count, std::memory_order_release);
  rt::futex::wake(wake_count_);
}

void shared_inbox::close() noexcept {
  closed_.store(true, std::memory_order_seq_cst);
  wake_receiver(1);
}

// ---- The service thread.

status shared_inbox::may_deliver(std::string_view text) const noexcept {
  if (is_closed()) return errc::closed;
  if (text.size() <= texts_.payload_bytes()) return {};
  return error{errc::too_big, static_cast<std::int64_t>(text.size()),
               static_cast<std::int64_t>(texts_.payload_bytes())};
}

void shared_inbox::put(std::uint32_t slot, const inbound_header& header, std::string_view text) noexcept {
  slots_[slot] = {.header = header, .counted = true};
  slots_[slot].header.bytes = text.size();
  std::copy_n(text.data(), text.size(), reinterpret_cast<char*>(texts_.slot(slot).data()));
  // relaxed, both: this thread's own; and the tail releases the place for pop()
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  places_[tail & (places_.size() - 1)].store(slot, std::memory_order_relaxed);
  // seq_cst: releases the message; and stands before the load of sleepers_
  tail_.store(tail + 1, std::memory_order_seq_cst);
  wake_receiver(static_cast<std::uint32_t>(2 * (tail + 1)));
}

// Takes expired messages off the front of the inbox, as a receiver does. So expired messages do not keep
// fresh ones out of an inbox that nobody empties. The header may be read even if a receiver has just claimed
// the message, because only this thread writes headers; the claim decides.
void shared_inbox::drop_expired(rt::time_point now) noexcept {
  // acquire: pairs with the claims in pop(), so that the tail is not behind
  for (std::uint64_t head = head_.load(std::memory_order_acquire);
       head != tail_.load(std::memory_order_relaxed);) { // relaxed: this thread's own
    // relaxed: this thread's own
    const std::uint32_t slot = places_[head & (places_.size() - 1)].load(std::memory_order_relaxed);
    if (slots_[slot].header.expires > now) return;
    // acq_rel, acquire: as in pop()
    if (!head_.compare_exchange_weak(head, head + 1, std::memory_order_acq_rel, std::memory_order_acquire))
      continue;
    drop(slot);
    ++head;
  }
}

// ---- Tests.

const char* shared_inbox::check() {
  std::vector<bool> seen(slots());
  std::size_t count = 0;
  if (free_count_ > marked_count_ || marked_count_ > slots()) return "no more slots are free than there are";
  for (const std::uint32_t slot : free_.first(marked_count_)) {
    if (slot >= slots() || seen[slot]) return "a slot is free once";
    seen[slot] = true;
  }
  if (!released_.sees_each_once(seen, count)) return "a slot is released once";
  const std::uint64_t head = head_.load(std::memory_order_seq_cst);
  const std::uint64_t tail = tail_.load(std::memory_order_seq_cst);
  if (tail - head > slots()) return "no more messages are in the inbox than there are slots";
  for (std::uint64_t i = head; i != tail; ++i) {
    const std::uint32_t slot = places_[i & (places_.size() - 1)].load(std::memory_order_seq_cst);
    if (slot >= slots() || seen[slot]) return "a slot is in one place";
    seen[slot] = true;
  }
  if (sleepers_.load(std::memory_order_seq_cst) != 0) return "nobody sleeps when nobody is inside";
  return nullptr;
}

bool shared_inbox::all_free() {
  std::vector<bool> seen(slots());
  std::size_t count = 0;
  return released_.sees_each_once(seen, count) && count + marked_count_ == slots();
}

} // namespace rowe::service
