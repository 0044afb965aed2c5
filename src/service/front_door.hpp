// SPDX-License-Identifier: Apache-2.0
// The front door: how threads that are not real-time, any number of them, coming and going, send, receive,
// invoke and reply through an endpoint. They may wait; the service thread on the other side never waits,
// locks or allocates. Two pools of slots, all of them there from the start:
//
//   outbound    home -> submit() -> take() -> settle() -> [wait(), reply_text()] -> give_back() -> home
//   inbound     home -> [collect_inbound() ->] deliver() -> receive() -> give_back_inbound() -> home
//
// The service thread collects inbound slots that came home before it uses them again: so it knows of each
// whose message it held, and how many of every peer's are still out.
//
// Only slot numbers travel. Where many threads put numbers they go by moodycamel's ConcurrentQueue, in which
// a producer may only be used by one thread at a time. A producer for each thread cannot be bounded, and one
// from a common set would have to be locked. So there is a producer for each *slot*: whoever holds a slot,
// and that is one thread at any time, puts its number by the slot's own producer. Each holds one number at
// most, so its first block serves for ever and nothing is allocated, however many threads come and go
// (front_door.cpp says how the memory is taken from the arena).
//
// moodycamel keeps the order within one producer, which says nothing here, so each submission draws a ticket
// and take() goes by tickets: what one thread submits goes in its order, and so does what one thread submits
// after it has heard of another's submission. The inbox has one producer, the service thread, and is a ring
// that several receivers take from in the order of arrival.
//
// A caller that runs out of time leaves its slot to the service thread: verdict.hpp.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/detail/lane.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/slab.hpp>

#include "service/verdict.hpp"

namespace rowe::service {

// What a thread outside asks for, or (message, invocation) what arrives for one.
enum class door_request : std::uint8_t { message, invocation, reply, refusal };

// What goes with the text of a slot.
struct door_header {
  door_request what = door_request::message;
  bool wants_outcome = false; // outbound: somebody will wait() for it
  bool counted = false;       // in: collect_inbound() is to tell when it comes home; the service thread's own
  detail::peer_ref peer{};    // out: to whom, generation 0: to everyone, or to whoever provides the service;
                              // in: from whom
  detail::call_ref call{};    // out: the call that a reply or refusal ends; in: the call that this asks
                              // (generation 0: none)
  rt::time_point stamped{};
  rt::time_point expires = rt::never;
  std::size_t bytes = 0; // of the text; submit() and deliver() write it
};

// Neither copied nor moved; nothing to destroy, so it may lie in the arena. A slot number from submit() or
// receive() belongs to the thread that got it (or to the one it is handed on to) until it is given back;
// using one afterwards is a programmer's error, found by assertions where it can be.
class front_door {
 public:
  // What the constructor takes from the arena. Never allocates.
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // Set-up. limits::door_slots slots each way, of limits::door_slot_bytes. Takes all its memory from the
  // arena, which holds footprint_bytes() more; nothing is allocated here or later.
  front_door(rt::arena& memory, const limits& bounds) noexcept;
  front_door(const front_door&) = delete;
  front_door& operator=(const front_door&) = delete;

  std::uint32_t slots() const noexcept { return outbound_.slots(); }
  std::size_t slot_bytes() const noexcept { return outbound_.payload_bytes(); }

  // ---- Any thread that is not real-time.

  // Copies the text into a free slot and queues it; the caller then wakes the service thread. Returns the
  // slot's number, which means something only if `wants_outcome`: then wait() must be called for it, once.
  // Does not wait, does not allocate. too_big: the text exceeds slot_bytes(); full: every slot is taken (or
  // the last one was just being taken); closed.
  result<std::uint32_t> submit(door_header header, std::string_view text) noexcept;

  // Sleeps until the slot's request is settled or `deadline` has come; `never` is for ever, which ends
  // because the service thread settles whatever it took, at the latest in finish(). True: outcome() and
  // reply_text() say what came of it, and the caller gives the slot back. False: out of time, or the service
  // thread has finished without it (then is_closed()); the caller must not touch the slot again, and the
  // service thread gives it back when the request, which runs on, has ended. Once for each submit() that
  // wants an outcome. Allocates nothing.
  bool wait(std::uint32_t slot, rt::time_point deadline) noexcept;

  // What settle() said, between a wait() that returned true and give_back(). The text is followed by
  // rt::tailroom_bytes that may be read.
  status outcome(std::uint32_t slot) const noexcept { return asked_[slot].outcome; }
  std::string_view reply_text(std::uint32_t slot) const noexcept;
  void give_back(std::uint32_t slot) noexcept;

  // The slot of the oldest message that has arrived and not expired by `now`: inbound_header() and
  // inbound_text() say what it is, until give_back_inbound(). Expired ones are given back on the way and
  // counted. Does not wait, does not allocate. empty: nothing is there; closed: nothing is there and nothing
  // will come.
  result<std::uint32_t> try_receive(rt::time_point now) noexcept;
  // The same, but sleeps until there is one or `deadline` has come. Several threads may; each message goes to
  // one. timed_out, closed. Allocates nothing.
  result<std::uint32_t> receive(rt::time_point deadline) noexcept;

  const door_header& inbound_header(std::uint32_t slot) const noexcept { return inbox_[slot].header; }
  std::string_view inbound_text(std::uint32_t slot) const noexcept;
  // True when the service thread waits for one: the caller then wakes it.
  bool give_back_inbound(std::uint32_t slot) noexcept;

  // Sleeps until `ready()` is true, which is asked at once, and whenever a slot for a submission may have
  // become free or the service thread has called tell_room(); or until `deadline` has come. Returns what
  // `ready()` said last. Several threads may. Allocates nothing.
  template <class Ready>
  bool wait_room(rt::time_point deadline, Ready&& ready) noexcept {
    // acq_rel: pairs with the addition in tell_room(), as said there
    room_waiters_.fetch_add(1, std::memory_order_acq_rel);
    bool there = false;
    for (bool in_time = true;;) {
      // acquire: pairs with the addition to the bell in tell_room()
      const std::uint32_t rung = room_bell_.load(std::memory_order_acquire);
      there = ready();
      if (there || !in_time) break;
      in_time = rt::futex::wait(room_bell_, rung, deadline);
    }
    room_waiters_.fetch_sub(1, std::memory_order_relaxed); // relaxed: a needless ring does no harm
    return there;
  }
  // Whether a submission would find a slot, if nobody else takes it: of a message to everyone, or another.
  bool has_room(bool to_everyone) const noexcept;

  // Whether anybody has ever called receive() or try_receive(). Advice: a moment old.
  bool manned() const noexcept;
  // How many messages expired in the inbox.
  std::uint64_t expired() const noexcept;

  // From now on submit() and deliver() say `closed`; sleeping receivers wake, and get what is left and then
  // `closed`. Whoever waits for an outcome goes on waiting, until the service thread settles or finishes.
  // Does not wait; several times are like once.
  void close() noexcept;
  bool is_closed() const noexcept;

  // ---- The service thread. Nothing here waits, locks or allocates; settle() and deliver() enter the kernel
  // ---- if somebody sleeps who must be woken.

  // Hands at most `most` submissions to `each(slot)`, in the order described above, and returns how many.
  // From then on request() and request_text() say what is asked; settle() must be called once for each, at
  // any time, `each` included.
  template <class Each>
  std::size_t take(Each&& each, std::size_t most) noexcept {
    std::size_t count = 0;
    for (std::uint32_t slot; count != most && take_one(slot); ++count) each(slot);
    return count;
  }
  const door_header& request(std::uint32_t slot) const noexcept { return asked_[slot].header; }
  std::string_view request_text(std::uint32_t slot) const noexcept;

  // Messages to everyone are refused with `full` from now on, or no more: too many wait for a peer's room.
  // True where that is new.
  bool refuse_to_everyone(bool refuses) noexcept {
    // relaxed, both: ours alone; advice, which has_room() and submit() act on
    if (crowded_.load(std::memory_order_relaxed) == refuses) return false;
    crowded_.store(refuses, std::memory_order_relaxed);
    return true;
  }
  // Wakes those who wait in wait_room(): room may have come.
  void tell_room() noexcept;

  // Ends a request: the outcome, and for an invocation the reply's text (which may be the request's own
  // bytes). A text that exceeds slot_bytes() is left out, and a good outcome becomes `too_big`, with size and
  // limit. Wakes whoever waits; gives the slot back if nobody does or will.
  void settle(std::uint32_t slot, const status& outcome, std::string_view reply = {}) noexcept;

  // Calls `came_home(detail::peer_ref)` for each message whose slot came home since the last call, with whom
  // it was from. Returns how many slots are free now.
  template <class CameHome>
  std::uint32_t collect_inbound(CameHome&& came_home) noexcept {
    mark_inbound();
    return collect_marked(came_home);
  }
  // The same in two steps: of those that are home at the first.
  void mark_inbound() noexcept;
  template <class CameHome>
  std::uint32_t collect_marked(CameHome&& came_home) noexcept {
    for (; free_inbound_count_ != marked_inbound_count_; ++free_inbound_count_) {
      arrived_slot& one = inbox_[free_inbound_[free_inbound_count_]];
      if (std::exchange(one.header.counted, false)) came_home(one.header.peer);
    }
    return free_inbound_count_;
  }
  // How many submissions take() has not handed on. One under way on another thread counts as soon as it has
  // its ticket.
  std::uint64_t submitted() const noexcept {
    // acquire: pairs with the drawing of tickets in submit()
    return tickets_.load(std::memory_order_acquire) - taken_;
  }
  // Of the messages that are there now collect_inbound() says nothing any more.
  void forget_senders() noexcept;
  std::uint32_t free_inbound() const noexcept { return free_inbound_count_; } // that were collected
  // Who gives an inbound slot back from now on is told to wake this thread, once. Collect after it.
  void ask_for_slots() noexcept {
    // acq_rel: pairs with the exchange in give_back_inbound()
    slots_wanted_.exchange(1, std::memory_order_acq_rel);
  }
  // Messages at the front of the inbox that have expired by `now` go home, and are counted.
  void drop_expired(rt::time_point now) noexcept;

  // Puts a message into the inbox and wakes a receiver. full: every slot is in the inbox, not expired by
  // header.stamped (when it is at the front), or in the hands of a receiver; too_big: the text exceeds
  // slot_bytes(); closed. `came_home` as for collect_inbound().
  template <class CameHome>
  status deliver(const door_header& header, std::string_view text, CameHome&& came_home) noexcept {
    if (const status may = may_deliver(text); !may) return may;
    if (free_inbound_count_ == 0 && collect_inbound(came_home) == 0) {
      drop_expired(header.stamped);
      if (collect_inbound(came_home) == 0) return error{errc::full, 0, slots()};
    }
    put_into_inbox(take_free_inbound(), header, text);
    return {};
  }
  status deliver(const door_header& header, std::string_view text) noexcept {
    return deliver(header, text, [](detail::peer_ref) {});
  }

  // The oldest message that nobody received, as receive() would give it; nothing when there is none. For a
  // lane that begins to receive where nobody has: give_back_inbound() follows.
  std::optional<std::uint32_t> take_back(rt::time_point now) noexcept;

  // How many requests were taken and not settled.
  std::uint32_t unsettled() const noexcept { return unsettled_count_; }
  // Nothing is submitted that was not taken, and nothing taken that was not settled. A submission under way
  // on another thread counts as submitted as soon as it has its ticket.
  bool drained() const noexcept;
  // The last call of the service thread, or of whoever has joined it: closes, and settles with `closed`
  // whatever was submitted and not settled. Nobody waits for an outcome in vain afterwards: a submission
  // under way on another thread is either settled here, or its wait() returns false at once.
  void finish() noexcept;

  // ---- Tests, when no thread is inside.

  // The invariant that is broken, or nullptr. Allocates.
  const char* check();
  // Whether every slot of both pools is at home. Allocates.
  bool all_home();

 private:
  class number_queue; // moodycamel's, with a producer for each slot

  // One of the outbound pool.
  struct asked_slot {
    verdict<> word;
    door_header header;
    status outcome;
    std::size_t reply_bytes = 0;
    std::uint64_t ticket = 0;
    bool unsettled = false; // the service thread took it and has not settled it
  };
  // One of the inbound pool.
  struct arrived_slot {
    door_header header;
  };
  using number = rt::std_atomics::variable<std::uint32_t>;

  bool take_one(std::uint32_t& slot) noexcept;
  void collect() noexcept;
  bool pop_inbox(std::uint32_t& slot) noexcept;
  bool pop_unexpired(std::uint32_t& slot, rt::time_point now) noexcept;
  void drop(std::uint32_t slot) noexcept;
  void man() noexcept;
  status may_deliver(std::string_view text) const noexcept;
  std::uint32_t take_free_inbound() noexcept {
    // The last of those that are marked takes its place: only what is not collected has an order.
    const std::uint32_t slot = free_inbound_[--free_inbound_count_];
    free_inbound_[free_inbound_count_] = free_inbound_[--marked_inbound_count_];
    return slot;
  }
  void put_into_inbox(std::uint32_t slot, const door_header& header, std::string_view text) noexcept;
  void wake_receiver(std::uint32_t bell) noexcept;

  // Set-up.
  rt::slab outbound_;
  rt::slab inbound_;
  std::span<asked_slot> asked_;
  std::span<arrived_slot> inbox_;
  number_queue* home_ = nullptr;         // outbound numbers that are free; any thread puts and takes
  number_queue* submitted_ = nullptr;    // any thread puts, the service thread takes
  number_queue* inbound_home_ = nullptr; // any thread puts, the service thread takes
  std::span<number> places_;             // the inbox's ring, a power of two, at least slots()

  // Any thread.
  alignas(rt::line_bytes) std::atomic<std::uint64_t> tickets_{0};    // drawn by submit()
  std::atomic<std::uint32_t> room_waiters_{0};
  std::atomic<std::uint32_t> room_rings_{0};
  rt::futex::word room_bell_{0}; // changes when those who wait for room should look
  alignas(rt::line_bytes) std::atomic<std::uint64_t> inbox_head_{0}; // taken from the inbox
  std::atomic<std::uint32_t> sleepers_{0};                           // receivers asleep, or nearly
  std::atomic<std::uint64_t> expired_{0};
  std::atomic<bool> manned_{false};
  alignas(rt::line_bytes) std::atomic<std::uint64_t> inbox_tail_{0}; // written by the service thread
  rt::futex::word bell_{0};                                          // changes when receivers should look
  std::atomic<std::uint32_t> slots_wanted_{0};                       // by the service thread: inbound ones
  alignas(rt::line_bytes) std::atomic<bool> closed_{false};
  std::atomic<bool> crowded_{false};
  std::atomic<std::uint32_t> finished_{0};

  // The service thread.
  alignas(rt::line_bytes) std::span<std::uint32_t> waiting_; // numbers out of submitted_, ascending tickets
  std::uint32_t waiting_first_ = 0;
  std::uint32_t waiting_last_ = 0;  // one past
  std::uint32_t waiting_ready_ = 0; // one past those that may go
  std::uint32_t unsettled_count_ = 0;
  std::uint32_t free_inbound_count_ = 0;
  std::uint32_t marked_inbound_count_ = 0;
  std::span<std::uint32_t> free_inbound_; // slots that were collected, and behind them those that are marked
  std::uint64_t taken_ = 0; // tickets that went to the core
};

} // namespace rowe::service
