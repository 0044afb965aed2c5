// SPDX-License-Identifier: Apache-2.0
#include "service/threads/submission_queue.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <type_traits>
#include <vector>

namespace rowe::service {

std::size_t submission_queue::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  const std::uint32_t slots = bounds.door_slots;
  return arena::bytes_for(rt::slab::bytes_for(slots, bounds.door_slot_bytes)) +
         arena::bytes_for<slot_state>(slots) + 2 * number_queue::footprint_bytes(slots) +
         arena::bytes_for<std::uint32_t>(slots);
}

submission_queue::submission_queue(rt::arena& memory, const limits& bounds) noexcept
    : texts_{memory.carve_bytes(rt::slab::bytes_for(bounds.door_slots, bounds.door_slot_bytes)),
             bounds.door_slots, bounds.door_slot_bytes},
      slots_{memory.carve<slot_state>(bounds.door_slots)},
      free_{memory, bounds.door_slots},
      submitted_{memory, bounds.door_slots},
      waiting_{memory.carve<std::uint32_t>(bounds.door_slots)} {
  static_assert(std::is_trivially_destructible_v<submission_queue>);
  assert(waiting_.size() == bounds.door_slots); // footprint_bytes() is the sum
  (void)submitted_.take_all(waiting_);          // nothing is submitted yet
}

// ---- Any thread.

result<std::uint32_t> submission_queue::submit(submission_header header, std::string_view text) noexcept {
  if (is_closed()) return errc::closed;
  if (text.size() > slot_bytes())
    return error{errc::too_big, static_cast<std::int64_t>(text.size()),
                 static_cast<std::int64_t>(slot_bytes())};
  const bool to_everyone = header.what == detail::entry::message && header.peer.generation == 0;
  // relaxed: advice; pairs with the store in refuse_to_everyone()
  if (to_everyone && crowded_.load(std::memory_order_relaxed)) return error{errc::full, 0, slots()};
  std::uint32_t slot = 0;
  if (!free_.take(slot)) return error{errc::full, 0, slots()};

  slot_state& asked = slots_[slot];
  asked.header = header;
  asked.header.bytes = text.size();
  std::copy_n(text.data(), text.size(), reinterpret_cast<char*>(texts_.slot(slot).data()));
  asked.word.arm(header.wants_outcome);
  // release: pairs with the acquire in collect(), which then has seen every earlier put of this thread, and
  // of threads that it has acquired from
  asked.ticket = tickets_.fetch_add(1, std::memory_order_release);
  submitted_.put(slot);
  return slot;
}

bool submission_queue::wait(std::uint32_t slot, rt::time_point deadline) noexcept {
  assert(slots_[slot].header.wants_outcome);
  // This adds nothing; it only takes a place in the order of the word. If it comes before the exchange in
  // finish(), the submission happens before all that finish() does, and finish() completes it. If it comes
  // after, nobody may come to complete it. acq_rel: pairs with the exchange in finish()
  if (finished_.fetch_or(0, std::memory_order_acq_rel) != 0)
    return slots_[slot].word.abandon() == slot_holder::submitter;
  return slots_[slot].word.wait_until(deadline) == slot_holder::submitter;
}

std::string_view submission_queue::reply_text(std::uint32_t slot) const noexcept {
  return {reinterpret_cast<const char*>(texts_.slot(slot).data()), slots_[slot].reply_bytes};
}

void submission_queue::release(std::uint32_t slot) noexcept {
  free_.put(slot);
  notify_room();
}

bool submission_queue::has_room(bool to_everyone) const noexcept {
  // relaxed: advice; pairs with the store in refuse_to_everyone(), which notify_room() follows
  if (to_everyone && crowded_.load(std::memory_order_relaxed)) return false;
  return free_.has_any();
}

// No wake-up is lost. The additions to room_waiters_ have one order. If this one comes later, it finds the
// waiter and changes the count. If it comes first, the waiter acquires from it, so ready() finds what was
// done before.
void submission_queue::notify_room() noexcept {
  // acq_rel: pairs with the addition in wait_room()
  const std::uint32_t waiters = room_waiters_.fetch_add(0, std::memory_order_acq_rel);
  if (waiters == 0) return;
  // relaxed: for a number that nobody else has. release: pairs with the load in wait_room()
  const std::uint32_t count = room_notifications_.fetch_add(1, std::memory_order_relaxed) + 1;
  room_wake_count_.exchange(count, std::memory_order_release);
  for (std::uint32_t i = 0; i != waiters; ++i) rt::futex::wake(room_wake_count_);
}

void submission_queue::close() noexcept {
  closed_.store(true, std::memory_order_seq_cst);
  notify_room();
}

bool submission_queue::is_closed() const noexcept { return closed_.load(std::memory_order_seq_cst); }

// ---- The service thread.

// Every submission with a ticket below the limit may go, in the order of tickets. All that came before such a
// ticket, from the same thread or one that it had acquired from, has a lower ticket. It was put before the
// limit was read, so it is found here, or was found before. This does not hold for tickets from the limit on;
// they wait.
void submission_queue::collect() noexcept {
  // acquire: pairs with the drawing of tickets in submit()
  const std::uint64_t limit = tickets_.load(std::memory_order_acquire);
  if (limit == taken_) return;
  std::copy(waiting_.begin() + waiting_first_, waiting_.begin() + waiting_last_, waiting_.begin());
  waiting_last_ -= waiting_first_;
  waiting_first_ = 0;
  waiting_last_ += static_cast<std::uint32_t>(submitted_.take_all(waiting_.subspan(waiting_last_)));
  const auto last = waiting_.begin() + waiting_last_;
  std::sort(waiting_.begin(), last,
            [this](std::uint32_t a, std::uint32_t b) { return slots_[a].ticket < slots_[b].ticket; });
  const auto ready =
      std::find_if(waiting_.begin(), last, [&](std::uint32_t slot) { return slots_[slot].ticket >= limit; });
  waiting_ready_ = static_cast<std::uint32_t>(ready - waiting_.begin());
}

bool submission_queue::take_one(std::uint32_t& slot) noexcept {
  if (waiting_first_ == waiting_ready_) collect();
  if (waiting_first_ == waiting_ready_) return false;
  slot = waiting_[waiting_first_++];
  ++taken_;
  slots_[slot].incomplete = true;
  ++incomplete_count_;
  return true;
}

std::string_view submission_queue::request_text(std::uint32_t slot) const noexcept {
  return {reinterpret_cast<const char*>(texts_.slot(slot).data()), slots_[slot].header.bytes};
}

void submission_queue::complete(std::uint32_t slot, const status& outcome, std::string_view reply) noexcept {
  slot_state& asked = slots_[slot];
  assert(asked.incomplete);
  asked.incomplete = false;
  --incomplete_count_;
  asked.outcome = outcome;
  const bool fits = reply.size() <= slot_bytes();
  asked.reply_bytes = fits ? reply.size() : 0;
  if (asked.reply_bytes != 0) std::memmove(texts_.slot(slot).data(), reply.data(), reply.size());
  if (outcome && !fits)
    asked.outcome = error{errc::too_big, static_cast<std::int64_t>(reply.size()),
                          static_cast<std::int64_t>(slot_bytes())};
  if (asked.word.complete() == slot_holder::service) release(slot);
}

void submission_queue::finish() noexcept {
  close();
  // acq_rel: pairs with wait(), as said there
  finished_.exchange(1, std::memory_order_acq_rel);
  for (std::uint32_t slot = 0; slot != slots(); ++slot)
    if (slots_[slot].incomplete) complete(slot, errc::closed);
  take([this](std::uint32_t slot) { complete(slot, errc::closed); }, SIZE_MAX);
  waiting_ready_ = waiting_last_; // order means nothing any more
  take([this](std::uint32_t slot) { complete(slot, errc::closed); }, SIZE_MAX);
}

// ---- Tests.

const char* submission_queue::check() {
  std::vector<bool> seen(slots());
  std::size_t count = 0;
  if (!free_.sees_each_once(seen, count) || !submitted_.sees_each_once(seen, count))
    return "a slot is in one place";
  for (std::uint32_t i = waiting_first_; i != waiting_last_; ++i) {
    if (seen[waiting_[i]]) return "a slot that waits to be taken is nowhere else";
    seen[waiting_[i]] = true;
  }
  std::uint32_t incomplete = 0;
  for (std::uint32_t slot = 0; slot != slots(); ++slot) {
    incomplete += slots_[slot].incomplete;
    if (slots_[slot].incomplete && seen[slot]) return "a slot that was taken is nowhere else";
  }
  if (incomplete != incomplete_count_) return "as many requests are incomplete as are marked so";
  if (waiting_first_ > waiting_ready_ || waiting_ready_ > waiting_last_) return "what may go waits";
  return nullptr;
}

bool submission_queue::all_free() {
  std::vector<bool> seen(slots());
  std::size_t count = 0;
  return free_.sees_each_once(seen, count) && count == slots();
}

} // namespace rowe::service
