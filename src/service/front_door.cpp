// SPDX-License-Identifier: Apache-2.0
//
// ThreadSanitizer does not see moodycamel's stand-alone fences, and gcc says so. They order a producer's use
// of a block after the takers' of the same block. Here the numbers do that as well: a producer is used by
// whoever holds its slot, which comes, by acquires and releases that are seen, after the number's last taker.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wtsan"
#endif
#include "service/front_door.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <concurrentqueue/concurrentqueue.h>

namespace rowe::service {

namespace {

// Where moodycamel's queue takes its memory from while it is set up: a piece of the arena. At all other times
// there is none, so the queue cannot allocate even where its code would like to.
struct memory_piece {
  std::byte* next;
  std::byte* end;
};
constinit thread_local memory_piece* source = nullptr;

constexpr std::size_t piece_alignment = alignof(std::max_align_t);
constexpr std::size_t rounded(std::size_t bytes) noexcept {
  return (bytes + piece_alignment - 1) / piece_alignment * piece_alignment;
}

struct queue_traits : moodycamel::ConcurrentQueueDefaultTraits {
  static const std::size_t BLOCK_SIZE = 2; // the smallest there is; a producer holds one number at most
  static const std::size_t EXPLICIT_INITIAL_INDEX_SIZE = 2;         // likewise, in blocks
  static const std::size_t INITIAL_IMPLICIT_PRODUCER_HASH_SIZE = 0; // no producers but those made at set-up

  static void* malloc(std::size_t bytes) noexcept {
    if (source == nullptr || rounded(bytes) > static_cast<std::size_t>(source->end - source->next))
      return nullptr;
    return std::exchange(source->next, source->next + rounded(bytes));
  }
  static void free(void*) noexcept {} // the arena's memory goes with the arena
};

using queue = moodycamel::ConcurrentQueue<std::uint32_t, queue_traits>;

// A queue's producer for one slot, with its first block, which serves for ever: the number is put again only
// by whoever took it, and taking leaves the block empty, so that the producer uses it anew.
void make_producer(queue& of, moodycamel::ProducerToken* at, std::uint32_t slot) noexcept {
  std::construct_at(at, of);
  [[maybe_unused]] const bool there = at->valid() && of.enqueue(*at, slot);
  assert(there); // else the sum in bytes_per_producer() is wrong
}

// What one producer takes, by making one: moodycamel does not say.
std::size_t bytes_per_producer() noexcept {
  constexpr std::size_t enough = 4096;
  alignas(piece_alignment) std::byte memory[enough];
  memory_piece piece{memory, memory + enough};
  source = &piece;
  {
    queue measured{0};
    alignas(moodycamel::ProducerToken) std::byte token[sizeof(moodycamel::ProducerToken)];
    auto* const producer = reinterpret_cast<moodycamel::ProducerToken*>(token);
    make_producer(measured, producer, 0);
    std::destroy_at(producer);
  }
  source = nullptr;
  return static_cast<std::size_t>(piece.next - memory);
}

// A place in the ring of the inbox for every slot.
std::size_t inbox_places(std::uint32_t slots) noexcept {
  return std::bit_ceil(std::max<std::size_t>(slots, 1));
}

} // namespace

// Slot numbers that many threads put, each by the producer of the slot, which the thread holds; all are in it
// when it is made. Nothing waits or allocates. Whoever takes a number acquires what its putter did before.
class front_door::number_queue {
 public:
  static std::size_t footprint_bytes(std::uint32_t slots) noexcept {
    return rt::arena::bytes_for<number_queue>() + rt::arena::bytes_for<moodycamel::ProducerToken>(slots) +
           rt::arena::bytes_for(bytes_per_producer() * slots);
  }

  // In the arena, and never destroyed.
  static number_queue* make(rt::arena& memory, std::uint32_t slots) noexcept {
    const std::span<std::byte> place = memory.carve_bytes(sizeof(number_queue));
    const auto tokens = memory.carve_bytes(sizeof(moodycamel::ProducerToken) * slots);
    const auto producers = memory.carve_bytes(bytes_per_producer() * slots);
    assert(!place.empty() && (slots == 0 || !producers.empty())); // footprint_bytes() is the sum
    memory_piece piece{producers.data(), producers.data() + producers.size()};
    source = &piece;
    auto* const made = ::new (static_cast<void*>(place.data()))
        number_queue{reinterpret_cast<moodycamel::ProducerToken*>(tokens.data()), slots};
    source = nullptr;
    return made;
  }

  // The thread that holds the slot.
  void put(std::uint32_t slot) noexcept {
    [[maybe_unused]] const bool put = queue_.try_enqueue(producers_[slot], slot);
    assert(put); // else the slot was put twice
  }
  // Any thread; a number may hide while others are taking. If there is one taker, it finds every number whose
  // put happened before.
  bool take(std::uint32_t& slot) noexcept { return queue_.try_dequeue(slot); }
  std::size_t take_all(std::span<std::uint32_t> into) noexcept {
    return into.empty() ? 0 : queue_.try_dequeue_bulk(into.data(), into.size());
  }
  // Any thread: whether there is one, as far as it has heard of it.
  bool has_any() const noexcept { return queue_.size_approx() != 0; }

 private:
  number_queue(moodycamel::ProducerToken* producers, std::uint32_t slots) noexcept : producers_{producers} {
    for (std::uint32_t slot = 0; slot != slots; ++slot) make_producer(queue_, producers_ + slot, slot);
  }

  queue queue_{0};
  moodycamel::ProducerToken* producers_;
};

std::size_t front_door::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  const std::uint32_t slots = bounds.door_slots;
  return 2 * arena::bytes_for(rt::slab::bytes_for(slots, bounds.door_slot_bytes)) +
         arena::bytes_for<asked_slot>(slots) + arena::bytes_for<arrived_slot>(slots) +
         3 * number_queue::footprint_bytes(slots) + arena::bytes_for<number>(inbox_places(slots)) +
         2 * arena::bytes_for<std::uint32_t>(slots);
}

front_door::front_door(rt::arena& memory, const limits& bounds) noexcept {
  static_assert(std::is_trivially_destructible_v<front_door>);
  const std::uint32_t slots = bounds.door_slots;
  const std::size_t bytes = bounds.door_slot_bytes;
  outbound_ = rt::slab{memory.carve_bytes(rt::slab::bytes_for(slots, bytes)), slots, bytes};
  inbound_ = rt::slab{memory.carve_bytes(rt::slab::bytes_for(slots, bytes)), slots, bytes};
  asked_ = memory.carve<asked_slot>(slots);
  inbox_ = memory.carve<arrived_slot>(slots);
  home_ = number_queue::make(memory, slots);
  submitted_ = number_queue::make(memory, slots);
  inbound_home_ = number_queue::make(memory, slots);
  places_ = memory.carve<number>(inbox_places(slots));
  waiting_ = memory.carve<std::uint32_t>(slots);
  free_inbound_ = memory.carve<std::uint32_t>(slots);
  assert(free_inbound_.size() == slots); // footprint_bytes() is the sum
  (void)submitted_->take_all(waiting_); // nothing is submitted yet
}

// ---- Any thread: out.

result<std::uint32_t> front_door::submit(door_header header, std::string_view text) noexcept {
  if (is_closed()) return errc::closed;
  if (text.size() > slot_bytes())
    return error{errc::too_big, static_cast<std::int64_t>(text.size()),
                 static_cast<std::int64_t>(slot_bytes())};
  const bool to_everyone = header.what == door_request::message && header.peer.generation == 0;
  // relaxed: advice; pairs with the store in refuse_to_everyone()
  if (to_everyone && crowded_.load(std::memory_order_relaxed)) return error{errc::full, 0, slots()};
  std::uint32_t slot = 0;
  if (!home_->take(slot)) return error{errc::full, 0, slots()};

  asked_slot& asked = asked_[slot];
  asked.header = header;
  asked.header.bytes = text.size();
  std::copy_n(text.data(), text.size(), reinterpret_cast<char*>(outbound_.slot(slot).data()));
  asked.word.arm(header.wants_outcome);
  // release: pairs with the acquire in collect(), which thereby has seen every put that this thread, or one
  // it has heard of, made before
  asked.ticket = tickets_.fetch_add(1, std::memory_order_release);
  submitted_->put(slot);
  return slot;
}

bool front_door::wait(std::uint32_t slot, rt::time_point deadline) noexcept {
  assert(asked_[slot].header.wants_outcome);
  // The addition of nothing is there for its place in the order of the word: before finish() has written, the
  // submission happens before all that finish() does, which settles it; afterwards nobody may come.
  // acq_rel: pairs with the exchange in finish()
  if (finished_.fetch_or(0, std::memory_order_acq_rel) != 0)
    return asked_[slot].word.abandon() == slot_holder::asker;
  return asked_[slot].word.wait_until(deadline) == slot_holder::asker;
}

std::string_view front_door::reply_text(std::uint32_t slot) const noexcept {
  return {reinterpret_cast<const char*>(outbound_.slot(slot).data()), asked_[slot].reply_bytes};
}

void front_door::give_back(std::uint32_t slot) noexcept {
  home_->put(slot);
  tell_room();
}

bool front_door::has_room(bool to_everyone) const noexcept {
  // relaxed: advice; pairs with the store in refuse_to_everyone(), which tell_room() follows
  if (to_everyone && crowded_.load(std::memory_order_relaxed)) return false;
  return home_->has_any();
}

// No ring is lost. The additions to room_waiters_ stand in one order: where this one comes later, it finds
// who waits and changes the bell; where it comes before, the other acquires from it, and so ready() finds
// what was done before.
void front_door::tell_room() noexcept {
  // acq_rel: pairs with the addition in wait_room()
  const std::uint32_t waiters = room_waiters_.fetch_add(0, std::memory_order_acq_rel);
  if (waiters == 0) return;
  // relaxed: for a number that nobody else has. release: pairs with the load in wait_room()
  const std::uint32_t rung = room_rings_.fetch_add(1, std::memory_order_relaxed) + 1;
  room_bell_.exchange(rung, std::memory_order_release);
  for (std::uint32_t i = 0; i != waiters; ++i) rt::futex::wake(room_bell_);
}

// ---- Any thread: in.
//
// The ring has a place for every slot, so it is never full, and the number of an entry is read from its place
// *before* the entry is claimed: if the claim succeeds, the place held that number all the time. For it to be
// written again, the service thread must have delivered as many numbers as there are slots and have one more
// in hand; so one of those was taken out since and came home, and with it, in order, the entry in question
// was claimed: not by this thread, whose claim then fails.

bool front_door::pop_inbox(std::uint32_t& slot) noexcept {
  // acquire: pairs with the release of whoever claimed the entry before, so that the tail is not behind
  std::uint64_t head = inbox_head_.load(std::memory_order_acquire);
  // seq_cst: acquires what deliver() wrote; and stands after the sleeper's addition to sleepers_
  while (head != inbox_tail_.load(std::memory_order_seq_cst)) {
    // relaxed: ordered by the tail, which deliver() releases afterwards
    const std::uint32_t entry = places_[head & (places_.size() - 1)].load(std::memory_order_relaxed);
    // acq_rel, acquire: pair with each other, as above
    if (inbox_head_.compare_exchange_weak(head, head + 1, std::memory_order_acq_rel,
                                          std::memory_order_acquire)) {
      slot = entry;
      return true;
    }
  }
  return false;
}

bool front_door::pop_unexpired(std::uint32_t& slot, rt::time_point now) noexcept {
  while (pop_inbox(slot)) {
    if (inbox_[slot].header.expires >= now) return true;
    drop(slot);
  }
  return false;
}

void front_door::drop(std::uint32_t slot) noexcept {
  inbound_home_->put(slot);
  // relaxed: a number and no more; pairs with the load in expired()
  expired_.fetch_add(1, std::memory_order_relaxed);
}

std::optional<std::uint32_t> front_door::take_back(rt::time_point now) noexcept {
  std::uint32_t slot = 0;
  if (!pop_unexpired(slot, now)) return std::nullopt;
  return slot;
}

void front_door::man() noexcept {
  // relaxed, both: advice; pairs with manned()
  if (!manned_.load(std::memory_order_relaxed)) manned_.store(true, std::memory_order_relaxed);
}

result<std::uint32_t> front_door::try_receive(rt::time_point now) noexcept {
  man();
  std::uint32_t slot = 0;
  const bool closed = is_closed(); // first: what was delivered before is then found
  if (pop_unexpired(slot, now)) return slot;
  return closed ? errc::closed : errc::empty;
}

// No wake-up is lost. Either the service thread, after it has moved the tail, sees that somebody sleeps: then
// it changes the bell, and the sleeper either has not read the bell yet, and sees the tail, or is kept from
// sleeping by the kernel's comparison, or is woken. Or it does not: then it moved the tail before the sleeper
// added itself, who looks at the tail after that. (Four seq_cst accesses; closing is as delivering.)
result<std::uint32_t> front_door::receive(rt::time_point deadline) noexcept {
  man();
  std::uint32_t slot = 0;
  if (pop_unexpired(slot, rt::monotonic_clock::now())) return slot;
  sleepers_.fetch_add(1, std::memory_order_seq_cst);
  errc why = errc::timed_out;
  bool found = false;
  for (bool in_time = true;;) {
    // acquire: pairs with the exchange in wake_receiver()
    const std::uint32_t rung = bell_.load(std::memory_order_acquire);
    const bool closed = is_closed();
    found = pop_unexpired(slot, rt::monotonic_clock::now());
    if (closed) why = errc::closed;
    if (found || closed || !in_time) break;
    in_time = rt::futex::wait(bell_, rung, deadline);
  }
  sleepers_.fetch_sub(1, std::memory_order_seq_cst);
  if (why == errc::closed) rt::futex::wake(bell_); // a wake reaches one sleeper, so this one passes it on
  if (found) return slot;
  return why;
}

std::string_view front_door::inbound_text(std::uint32_t slot) const noexcept {
  return {reinterpret_cast<const char*>(inbound_.slot(slot).data()), inbox_[slot].header.bytes};
}

// As for tell_room(): either the service thread finds the slot when it collects, or its asking is found here.
bool front_door::give_back_inbound(std::uint32_t slot) noexcept {
  inbound_home_->put(slot);
  // acq_rel: pairs with the exchange in ask_for_slots()
  return slots_wanted_.exchange(0, std::memory_order_acq_rel) != 0;
}

bool front_door::manned() const noexcept {
  return manned_.load(std::memory_order_relaxed); // relaxed: advice; pairs with man()
}

std::uint64_t front_door::expired() const noexcept {
  return expired_.load(std::memory_order_relaxed); // relaxed: a number; pairs with drop()
}

// Changes the bell and wakes one, if anybody sleeps. The bell is even after a delivery and odd after closing,
// and never what a sleeper has read before: a value comes again after 2^31 deliveries only.
void front_door::wake_receiver(std::uint32_t bell) noexcept {
  if (sleepers_.load(std::memory_order_seq_cst) == 0) return;
  // release: pairs with the acquire in receive()
  bell_.exchange(bell, std::memory_order_release);
  rt::futex::wake(bell_);
}

void front_door::close() noexcept {
  closed_.store(true, std::memory_order_seq_cst);
  wake_receiver(1);
  tell_room();
}

bool front_door::is_closed() const noexcept { return closed_.load(std::memory_order_seq_cst); }

// ---- The service thread.

// Everything with a ticket below the limit may go, in the order of tickets. Whatever was put before the
// drawing of such a ticket, by the same thread or one that it had heard of, has a lower ticket, was put
// before the limit was read, and so is found here or was before. Of tickets not below the limit that cannot
// be said; they wait.
void front_door::collect() noexcept {
  // acquire: pairs with the drawing of tickets in submit()
  const std::uint64_t limit = tickets_.load(std::memory_order_acquire);
  if (limit == taken_) return;
  std::copy(waiting_.begin() + waiting_first_, waiting_.begin() + waiting_last_, waiting_.begin());
  waiting_last_ -= waiting_first_;
  waiting_first_ = 0;
  waiting_last_ += static_cast<std::uint32_t>(submitted_->take_all(waiting_.subspan(waiting_last_)));
  const auto last = waiting_.begin() + waiting_last_;
  std::sort(waiting_.begin(), last,
            [this](std::uint32_t a, std::uint32_t b) { return asked_[a].ticket < asked_[b].ticket; });
  const auto ready =
      std::find_if(waiting_.begin(), last, [&](std::uint32_t slot) { return asked_[slot].ticket >= limit; });
  waiting_ready_ = static_cast<std::uint32_t>(ready - waiting_.begin());
}

bool front_door::take_one(std::uint32_t& slot) noexcept {
  if (waiting_first_ == waiting_ready_) collect();
  if (waiting_first_ == waiting_ready_) return false;
  slot = waiting_[waiting_first_++];
  ++taken_;
  asked_[slot].unsettled = true;
  ++unsettled_count_;
  return true;
}

std::string_view front_door::request_text(std::uint32_t slot) const noexcept {
  return {reinterpret_cast<const char*>(outbound_.slot(slot).data()), asked_[slot].header.bytes};
}

void front_door::settle(std::uint32_t slot, const status& outcome, std::string_view reply) noexcept {
  asked_slot& asked = asked_[slot];
  assert(asked.unsettled);
  asked.unsettled = false;
  --unsettled_count_;
  asked.outcome = outcome;
  const bool fits = reply.size() <= slot_bytes();
  asked.reply_bytes = fits ? reply.size() : 0;
  if (asked.reply_bytes != 0) std::memmove(outbound_.slot(slot).data(), reply.data(), reply.size());
  if (outcome && !fits)
    asked.outcome = error{errc::too_big, static_cast<std::int64_t>(reply.size()),
                          static_cast<std::int64_t>(slot_bytes())};
  if (asked.word.settle() != slot_holder::settler) return;
  home_->put(slot);
  tell_room();
}

void front_door::mark_inbound() noexcept {
  marked_inbound_count_ +=
      static_cast<std::uint32_t>(inbound_home_->take_all(free_inbound_.subspan(marked_inbound_count_)));
}

void front_door::forget_senders() noexcept {
  for (arrived_slot& one : inbox_) one.header.counted = false;
}

status front_door::may_deliver(std::string_view text) const noexcept {
  if (is_closed()) return errc::closed;
  if (text.size() <= slot_bytes()) return {};
  return error{errc::too_big, static_cast<std::int64_t>(text.size()),
               static_cast<std::int64_t>(slot_bytes())};
}

void front_door::put_into_inbox(std::uint32_t slot, const door_header& header,
                                std::string_view text) noexcept {
  inbox_[slot].header = header;
  inbox_[slot].header.bytes = text.size();
  inbox_[slot].header.counted = true;
  std::copy_n(text.data(), text.size(), reinterpret_cast<char*>(inbound_.slot(slot).data()));
  // relaxed, both: this thread's own; and the tail releases the place for pop_inbox()
  const std::uint64_t tail = inbox_tail_.load(std::memory_order_relaxed);
  places_[tail & (places_.size() - 1)].store(slot, std::memory_order_relaxed);
  // seq_cst: releases the message; and stands before the load of sleepers_
  inbox_tail_.store(tail + 1, std::memory_order_seq_cst);
  wake_receiver(static_cast<std::uint32_t>(2 * (tail + 1)));
}

// Takes expired messages off the front of the inbox, as a receiver would: an inbox that nobody empties must
// not keep what is fresh out by what is not. The header may be read although a receiver may just have claimed
// the message, since only this thread writes headers; the claim decides.
void front_door::drop_expired(rt::time_point now) noexcept {
  // acquire: pairs with the claims in pop_inbox(), so that the tail is not behind
  for (std::uint64_t head = inbox_head_.load(std::memory_order_acquire);
       head != inbox_tail_.load(std::memory_order_relaxed);) { // relaxed: this thread's own
    // relaxed: this thread's own
    const std::uint32_t slot = places_[head & (places_.size() - 1)].load(std::memory_order_relaxed);
    if (inbox_[slot].header.expires >= now) return;
    // acq_rel, acquire: as in pop_inbox()
    if (!inbox_head_.compare_exchange_weak(head, head + 1, std::memory_order_acq_rel,
                                           std::memory_order_acquire))
      continue;
    drop(slot);
    ++head;
  }
}

bool front_door::drained() const noexcept {
  // acquire: pairs with the drawing of tickets in submit()
  return unsettled_count_ == 0 && tickets_.load(std::memory_order_acquire) == taken_;
}

void front_door::finish() noexcept {
  close();
  // acq_rel: pairs with wait(), as said there
  finished_.exchange(1, std::memory_order_acq_rel);
  for (std::uint32_t slot = 0; slot != slots(); ++slot)
    if (asked_[slot].unsettled) settle(slot, errc::closed);
  take([this](std::uint32_t slot) { settle(slot, errc::closed); }, SIZE_MAX);
  waiting_ready_ = waiting_last_; // order means nothing any more
  take([this](std::uint32_t slot) { settle(slot, errc::closed); }, SIZE_MAX);
}

// ---- Tests.

namespace {

// Takes all numbers out and puts them back; each must be that of a slot that was not seen before.
template <class Queue>
bool sees_each_once(Queue& numbers, std::vector<bool>& seen, std::size_t& count) {
  std::vector<std::uint32_t> found(seen.size() + 1);
  count = numbers.take_all(found);
  found.resize(count);
  bool right = count <= seen.size();
  for (const std::uint32_t slot : found) {
    right = right && slot < seen.size() && !seen[slot];
    if (!right) break;
    seen[slot] = true;
    numbers.put(slot);
  }
  return right;
}

} // namespace

const char* front_door::check() {
  std::vector<bool> seen(slots());
  std::size_t count = 0;
  if (!sees_each_once(*home_, seen, count) || !sees_each_once(*submitted_, seen, count))
    return "an outbound slot is in one place";
  for (std::uint32_t i = waiting_first_; i != waiting_last_; ++i) {
    if (seen[waiting_[i]]) return "a slot that waits to be taken is nowhere else";
    seen[waiting_[i]] = true;
  }
  std::uint32_t unsettled = 0;
  for (std::uint32_t slot = 0; slot != slots(); ++slot) {
    unsettled += asked_[slot].unsettled;
    if (asked_[slot].unsettled && seen[slot]) return "a slot that was taken is nowhere else";
  }
  if (unsettled != unsettled_count_) return "as many requests are unsettled as are marked so";
  if (waiting_first_ > waiting_ready_ || waiting_ready_ > waiting_last_) return "what may go waits";

  std::vector<bool> arrived(slots());
  if (free_inbound_count_ > marked_inbound_count_ || marked_inbound_count_ > slots())
    return "no more inbound slots are free than there are";
  for (const std::uint32_t slot : free_inbound_.first(marked_inbound_count_)) {
    if (slot >= slots() || arrived[slot]) return "an inbound slot is free once";
    arrived[slot] = true;
  }
  if (!sees_each_once(*inbound_home_, arrived, count)) return "an inbound slot is at home once";
  const std::uint64_t head = inbox_head_.load(std::memory_order_seq_cst);
  const std::uint64_t tail = inbox_tail_.load(std::memory_order_seq_cst);
  if (tail - head > slots()) return "no more messages are in the inbox than there are slots";
  for (std::uint64_t i = head; i != tail; ++i) {
    const std::uint32_t slot = places_[i & (places_.size() - 1)].load(std::memory_order_seq_cst);
    if (slot >= slots() || arrived[slot]) return "an inbound slot is in one place";
    arrived[slot] = true;
  }
  if (sleepers_.load(std::memory_order_seq_cst) != 0) return "nobody sleeps when nobody is inside";
  return nullptr;
}

bool front_door::all_home() {
  std::vector<bool> outbound(slots());
  std::vector<bool> inbound(slots());
  std::size_t outbound_count = 0;
  std::size_t inbound_count = 0;
  return sees_each_once(*home_, outbound, outbound_count) &&
         sees_each_once(*inbound_home_, inbound, inbound_count) && outbound_count == slots() &&
         inbound_count + marked_inbound_count_ == slots();
}

} // namespace rowe::service
