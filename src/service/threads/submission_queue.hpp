// SPDX-License-Identifier: Apache-2.0
// The submission queue: how threads that are not real-time send, invoke and reply through an endpoint. Any
// number of them may come and go. They may wait; the service thread on the other side never waits, locks or
// allocates. There is one pool of slots, all made at the start:
//
//   free -> submit() -> take() -> complete() -> [wait(), reply_text()] -> release() -> free
//
// Only slot numbers travel, through number_queue, which keeps no order. So each submission gets a ticket, and
// take() follows the order of tickets. It keeps the order in which one thread submits, also after a
// submission of another thread that it has heard of.
//
// A caller that runs out of time leaves its slot to the service thread: completion.hpp.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/slab.hpp>

#include "service/threads/completion.hpp"
#include "service/threads/number_queue.hpp"

namespace rowe::service {

// What goes with the text of a submission.
struct submission_header {
  detail::entry what = detail::entry::message;
  bool wants_outcome = false; // somebody will wait() for it
  detail::peer_ref peer{};    // to whom; generation 0: to everyone, or to whoever provides the service
  detail::call_ref call{};    // the call that a reply or refusal ends
  rt::time_point stamped{};
  rt::time_point expires = rt::never;
  std::size_t bytes = 0; // of the text; submit() writes it
};

// Neither copied nor moved; nothing to destroy, so it may lie in the arena. A slot number from submit()
// belongs to the thread that got it, or that it was handed to, until it is released. Using it afterwards is a
// programmer's error, which assertions find if they can.
class submission_queue {
 public:
  // What the constructor takes from the arena. Never allocates.
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // Set-up. limits::door_slots slots of limits::door_slot_bytes. Takes all its memory from the arena, which
  // holds footprint_bytes() more; nothing is allocated here or later.
  submission_queue(rt::arena& memory, const limits& bounds) noexcept;
  submission_queue(const submission_queue&) = delete;
  submission_queue& operator=(const submission_queue&) = delete;

  std::uint32_t slots() const noexcept { return texts_.slot_count(); }
  std::size_t slot_bytes() const noexcept { return texts_.payload_bytes(); }

  // ---- Any thread that is not real-time.

  // Copies the text into a free slot and queues it. The caller then wakes the service thread. Returns the
  // slot's number. Only with `wants_outcome` has it a meaning: then wait() must be called for it, once. Does
  // not wait, does not allocate. Errors: too_big, the text exceeds slot_bytes(); full, every slot is taken,
  // or the last one is being taken; closed.
  result<std::uint32_t> submit(submission_header header, std::string_view text) noexcept;

  // Sleeps until the request is completed or `deadline` has come. `never` is safe: the service thread
  // completes whatever it took, at the latest in finish(). True: read outcome() and reply_text(), then
  // release the slot. False: the time is over, or the service thread has finished without it (then
  // is_closed()). Do not touch the slot then: the request goes on, and the service thread releases the slot
  // at its end. Call it once for each submission that wants an outcome. Allocates nothing.
  bool wait(std::uint32_t slot, rt::time_point deadline) noexcept;

  // What complete() said, between a wait() that returned true and release(). The text is followed by
  // rt::tailroom_bytes that may be read.
  status outcome(std::uint32_t slot) const noexcept { return slots_[slot].outcome; }
  std::string_view reply_text(std::uint32_t slot) const noexcept;
  void release(std::uint32_t slot) noexcept;

  // Sleeps until `ready()` is true or `deadline` has come. It calls `ready()` at once, whenever a slot may
  // have become free, and whenever the service thread has called notify_room(). Returns what `ready()`
  // returned last. Several threads may call it. Allocates nothing.
  template <class Ready>
  bool wait_room(rt::time_point deadline, Ready&& ready) noexcept {
    // acq_rel: pairs with the addition in notify_room(), as said there
    room_waiters_.fetch_add(1, std::memory_order_acq_rel);
    bool there = false;
    for (bool in_time = true;;) {
      // acquire: pairs with the exchange of the count in notify_room()
      const std::uint32_t seen = room_wake_count_.load(std::memory_order_acquire);
      there = ready();
      if (there || !in_time) break;
      in_time = rt::futex::wait(room_wake_count_, seen, deadline);
    }
    room_waiters_.fetch_sub(1, std::memory_order_relaxed); // relaxed: a needless wake-up does no harm
    return there;
  }
  // Whether a submission would find a slot, if nobody else takes it. Messages to everyone may be refused
  // earlier.
  bool has_room(bool to_everyone) const noexcept;
  // Wakes those who wait in wait_room(): room may have come. Enters the kernel if somebody sleeps.
  void notify_room() noexcept;

  // From now on submit() says `closed`. Threads that wait for an outcome go on waiting, until the service
  // thread completes it or finishes. Does not wait; may be called again.
  void close() noexcept;
  bool is_closed() const noexcept;

  // ---- The service thread. Nothing here waits, locks or allocates; complete() enters the kernel if somebody
  // ---- sleeps who must be woken.

  // Calls `each(slot)` for at most `most` submissions, in the order described above, and returns how many.
  // From then on request() and request_text() have the request. complete() must be called once for each, at
  // any time, also in `each`.
  template <class Each>
  std::size_t take(Each&& each, std::size_t most) noexcept {
    std::size_t count = 0;
    for (std::uint32_t slot; count != most && take_one(slot); ++count) each(slot);
    return count;
  }
  const submission_header& request(std::uint32_t slot) const noexcept { return slots_[slot].header; }
  std::string_view request_text(std::uint32_t slot) const noexcept;

  // From now on, messages to everyone are refused with `full`, or are not any more. They are refused while
  // too many are parked. True if this is a change.
  bool refuse_to_everyone(bool refuses) noexcept {
    // relaxed, both: ours alone; advice, which has_room() and submit() act on
    if (crowded_.load(std::memory_order_relaxed) == refuses) return false;
    crowded_.store(refuses, std::memory_order_relaxed);
    return true;
  }

  // Ends a request, with its outcome and, for an invocation, the text of the reply (which may be the
  // request's own bytes). A text that exceeds slot_bytes() is left out, and a good outcome becomes `too_big`,
  // with size and limit. Wakes the thread that waits; releases the slot if none waits or will.
  void complete(std::uint32_t slot, const status& outcome, std::string_view reply = {}) noexcept;

  // How many submissions take() has not taken. One that another thread is just submitting counts as soon as
  // it has its ticket.
  std::uint64_t submitted() const noexcept {
    // acquire: pairs with the drawing of tickets in submit()
    return tickets_.load(std::memory_order_acquire) - taken_;
  }
  // How many requests were taken and not completed.
  std::uint32_t incomplete() const noexcept { return incomplete_count_; }
  // Nothing is submitted that was not taken, and nothing taken that was not completed.
  bool drained() const noexcept { return incomplete_count_ == 0 && submitted() == 0; }
  // The last call of the service thread, or of the thread that joined it. Closes the queue, and completes all
  // that is left with `closed`. Nobody waits in vain afterwards: a submission that another thread is just
  // making is either completed here, or its wait() returns false at once.
  void finish() noexcept;

  // ---- Tests, when no thread is inside.

  // The invariant that is broken, or nullptr. Allocates.
  const char* check();
  // Whether every slot is free. Allocates.
  bool all_free();

 private:
  struct slot_state {
    completion<> word;
    submission_header header;
    status outcome;
    std::size_t reply_bytes = 0;
    std::uint64_t ticket = 0;
    bool incomplete = false; // the service thread took it and has not completed it
  };

  bool take_one(std::uint32_t& slot) noexcept;
  void collect() noexcept;

  // Set-up.
  rt::slab texts_;
  std::span<slot_state> slots_;
  number_queue free_;      // any thread puts and takes
  number_queue submitted_; // any thread puts, the service thread takes

  // Any thread.
  alignas(rt::line_bytes) std::atomic<std::uint64_t> tickets_{0}; // taken by submit()
  std::atomic<std::uint32_t> room_waiters_{0};
  std::atomic<std::uint32_t> room_notifications_{0};
  rt::futex::word room_wake_count_{0}; // changes when those who wait for room should look
  alignas(rt::line_bytes) std::atomic<bool> closed_{false};
  std::atomic<bool> crowded_{false};
  std::atomic<std::uint32_t> finished_{0};

  // The service thread.
  alignas(rt::line_bytes) std::span<std::uint32_t> waiting_; // numbers out of submitted_, ascending tickets
  std::uint32_t waiting_first_ = 0;
  std::uint32_t waiting_last_ = 0;  // one past
  std::uint32_t waiting_ready_ = 0; // one past those that may go
  std::uint32_t incomplete_count_ = 0;
  std::uint64_t taken_ = 0; // tickets that take() handed on
};

} // namespace rowe::service
