// SPDX-License-Identifier: Apache-2.0
// The shared inbox: how threads that are not real-time receive through an endpoint. Any number of them may
// come and go. They may wait; the service thread, which delivers, never waits, locks or allocates. There is
// one pool of slots, all made at the start:
//
//   free -> deliver() -> receive() -> release() -> [collect() ->] free
//
// The service thread collects released slots before it uses them again. So it learns from whom each message
// was, and knows how many messages of each peer are not released yet.
//
// The inbox has one producer, the service thread. It is a ring from which several receivers take in the order
// of arrival. Released slots come back through number_queue.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/slab.hpp>

#include "service/threads/number_queue.hpp"

namespace rowe::service {

// What goes with the text of a message that has arrived.
struct inbound_header {
  detail::entry what = detail::entry::message; // or invocation
  detail::peer_ref peer{};                     // from whom
  detail::call_ref call{};                     // that it asks; generation 0: none
  rt::time_point stamped{};
  rt::time_point expires = rt::never;
  std::size_t bytes = 0; // of the text; deliver() writes it
};

// Neither copied nor moved; nothing to destroy, so it may lie in the arena. A slot number from receive()
// belongs to the thread that got it, or that it was handed to, until it is released. Using it afterwards is a
// programmer's error.
class shared_inbox {
 public:
  // What the constructor takes from the arena. Never allocates.
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // Set-up. limits::door_slots slots of limits::door_slot_bytes. Takes all its memory from the arena, which
  // holds footprint_bytes() more; nothing is allocated here or later.
  shared_inbox(rt::arena& memory, const limits& bounds) noexcept;
  shared_inbox(const shared_inbox&) = delete;
  shared_inbox& operator=(const shared_inbox&) = delete;

  std::uint32_t slots() const noexcept { return texts_.slot_count(); }

  // ---- Any thread that is not real-time.

  // Takes the oldest message that has not expired by `now`, and returns its slot: header() and text() say
  // what it is, until release(). Expired messages before it are released, and counted. Does not wait, does
  // not allocate. Errors: empty; closed: nothing is there and nothing will come.
  result<std::uint32_t> try_receive(rt::time_point now) noexcept;
  // The same, but it sleeps until there is a message or `deadline` has come. Several threads may call it;
  // each message goes to one. Allocates nothing. Errors: timed_out, closed.
  result<std::uint32_t> receive(rt::time_point deadline) noexcept;

  const inbound_header& header(std::uint32_t slot) const noexcept { return slots_[slot].header; }
  std::string_view text(std::uint32_t slot) const noexcept {
    return {reinterpret_cast<const char*>(texts_.slot(slot).data()), slots_[slot].header.bytes};
  }
  // Releases a slot. True: the service thread waits for one, and the caller then wakes it.
  bool release(std::uint32_t slot) noexcept;

  // Whether anybody has ever called receive() or try_receive(). Advice: a moment old.
  bool has_receiver() const noexcept {
    return has_receiver_.load(std::memory_order_relaxed); // relaxed: advice; pairs with note_receiver()
  }
  // How many messages expired in the inbox.
  std::uint64_t expired() const noexcept {
    return expired_.load(std::memory_order_relaxed); // relaxed: a number; pairs with drop()
  }

  // From now on deliver() says `closed`. Receivers wake, get what is left, and then `closed`. Does not wait.
  void close() noexcept;

  // ---- The service thread. Nothing here waits, locks or allocates; deliver() enters the kernel if somebody
  // ---- sleeps who must be woken.

  // Puts a message into the inbox and wakes a receiver. full: no slot is free, even after the messages at the
  // front of the inbox that had expired by header.stamped were dropped; too_big: the text exceeds a slot;
  // closed. `released` as for collect().
  template <class Released>
  status deliver(const inbound_header& header, std::string_view text, Released&& released) noexcept {
    if (const status may = may_deliver(text); !may) return may;
    if (free_count_ == 0 && collect(released) == 0) {
      drop_expired(header.stamped);
      if (collect(released) == 0) return error{errc::full, 0, slots()};
    }
    put(take_free(), header, text);
    return {};
  }
  status deliver(const inbound_header& header, std::string_view text) noexcept {
    return deliver(header, text, [](detail::peer_ref) {});
  }

  // Calls `released(sender)` for each message whose slot was released since the last call; `sender` is a
  // detail::peer_ref. Returns how many slots are free now.
  template <class Released>
  std::uint32_t collect(Released&& released) noexcept {
    mark();
    return collect_marked(released);
  }
  // The same in two steps: mark() records which slots are released, collect_marked() reports them.
  void mark() noexcept {
    if (marked_count_ == free_.size()) return; // all slots are free
    marked_count_ += static_cast<std::uint32_t>(released_.take_all(free_.subspan(marked_count_)));
  }
  template <class Released>
  std::uint32_t collect_marked(Released&& released) noexcept {
    for (; free_count_ != marked_count_; ++free_count_) {
      slot_state& one = slots_[free_[free_count_]];
      if (std::exchange(one.counted, false)) released(one.header.peer);
    }
    return free_count_;
  }
  // From now on collect() does not report the messages that are in a slot now.
  void forget_senders() noexcept {
    for (slot_state& one : slots_) one.counted = false;
  }
  std::uint32_t free_slots() const noexcept { return free_count_; } // that were collected
  // Asks the next thread that releases a slot to wake the service thread. Call collect() after this.
  void ask_for_slots() noexcept {
    // acq_rel: pairs with the exchange in release()
    slots_wanted_.exchange(1, std::memory_order_acq_rel);
  }
  // Messages at the front of the inbox that have expired by `now` are released, and counted.
  void drop_expired(rt::time_point now) noexcept;

  // Takes the oldest message that nobody received, as receive() does; nothing if there is none. For the first
  // handle that begins to receive. release() must follow.
  std::optional<std::uint32_t> take_back(rt::time_point now) noexcept {
    std::uint32_t slot = 0;
    return pop_unexpired(slot, now) ? std::optional{slot} : std::nullopt;
  }

  // ---- Tests, when no thread is inside.

  // The invariant that is broken, or nullptr. Allocates.
  const char* check();
  // Whether every slot is free, or released. Allocates.
  bool all_free();

 private:
  struct slot_state {
    inbound_header header;
    bool counted = false; // collect() is to report its release; the service thread's own
  };
  using number = rt::std_atomics::variable<std::uint32_t>;

  bool is_closed() const noexcept { return closed_.load(std::memory_order_seq_cst); }
  bool pop(std::uint32_t& slot) noexcept;
  bool pop_unexpired(std::uint32_t& slot, rt::time_point now) noexcept;
  void drop(std::uint32_t slot) noexcept;
  void note_receiver() noexcept;
  void wake_receiver(std::uint32_t count) noexcept;
  status may_deliver(std::string_view text) const noexcept;
  std::uint32_t take_free() noexcept {
    // The last of those that are marked takes its place: only what is not collected has an order.
    const std::uint32_t slot = free_[--free_count_];
    free_[free_count_] = free_[--marked_count_];
    return slot;
  }
  void put(std::uint32_t slot, const inbound_header& header, std::string_view text) noexcept;

  // Set-up.
  rt::slab texts_;
  std::span<slot_state> slots_;
  number_queue released_;    // any thread puts, the service thread takes
  std::span<number> places_; // the ring: a place for every slot, a power of two

  // Any thread.
  alignas(rt::line_bytes) std::atomic<std::uint64_t> head_{0}; // received
  std::atomic<std::uint32_t> sleepers_{0};                     // receivers asleep, or nearly
  std::atomic<std::uint64_t> expired_{0};
  std::atomic<bool> has_receiver_{false};
  alignas(rt::line_bytes) std::atomic<std::uint64_t> tail_{0}; // delivered; written by the service thread
  rt::futex::word wake_count_{0};                              // changes when receivers should look
  std::atomic<std::uint32_t> slots_wanted_{0};                 // by the service thread
  alignas(rt::line_bytes) std::atomic<bool> closed_{false};

  // The service thread.
  alignas(rt::line_bytes) std::span<std::uint32_t> free_; // that were collected, and behind them the marked
  std::uint32_t free_count_ = 0;
  std::uint32_t marked_count_ = 0; // both together
};

} // namespace rowe::service
