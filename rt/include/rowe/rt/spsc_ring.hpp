// SPDX-License-Identifier: Apache-2.0
// A bounded queue from one thread to one other: every item arrives, in order, or the push is refused. It is
// the opening in the wall through which slot numbers go out. Lamport's queue (Specifying Concurrent Program
// Modules, TOPLAS 1983) with two additions: each side keeps its own index in private memory, so that a push
// loads no line that the other side has just fetched, and each side remembers the other's index as it last
// saw it, so that it looks again only when the ring seems full (or empty). A textbook ring without the
// private copy takes 1.7 times as long for a round trip between two cores; bench/hand_over.cpp measures both
// limits.
//
// Wait-free on both sides: try_push and try_pop are straight lines with one conditional second look, and
// neither contains a loop. The ends are types, given out once each, so that a second producer cannot come
// into being; they live inside the ring, not in the handles that point to them, so that moving a handle moves
// no index.
#pragma once
#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// T is copied in and out. Neither copied nor moved itself; has nothing to destroy, so that memory that held a
// ring may be built anew when no thread uses it any more.
template <class T, class Atomics = std_atomics>
class spsc_ring {
  static_assert(std::is_trivially_copyable_v<T>);
  using word = typename Atomics::template variable<std::uint64_t>;

 public:
  using value_type = T;
  using entry = typename Atomics::template plain<T>;

  // How many entries a ring needs that holds `items`: the next power of two.
  static constexpr std::size_t places_for(std::size_t items) noexcept { return std::bit_ceil(items); }

  // Set-up. `entries` are a power of two, need no initial value, and outlive the ring. Indices begin at
  // `first_index`, so that a test can stand close to where they wrap.
  explicit spsc_ring(std::span<entry> entries, std::uint64_t first_index = 0) noexcept
      : producer_{*this, entries, first_index},
        consumer_{*this, entries, first_index},
        tail_{first_index},
        head_{first_index} {
    assert(std::has_single_bit(entries.size()));
  }
  spsc_ring(const spsc_ring&) = delete;
  spsc_ring& operator=(const spsc_ring&) = delete;

  // The end that pushes. One thread at a time; passing it to another thread needs a hand-over of its own.
  class producer {
   public:
    // Never waits, never allocates. False when all places are taken: nothing was pushed.
    [[nodiscard]] ROWE_RT bool try_push(const T& item) noexcept {
      if (tail_ - seen_head_ > mask_) {
        seen_head_ = ring_.head_.load(std::memory_order_acquire); // pairs with the release in pop and drain
        if (tail_ - seen_head_ > mask_) return false;
      }
      entries_[tail_ & mask_].store(item);
      ++tail_;
      ring_.tail_.store(tail_, std::memory_order_release); // pairs with the acquire in consumer::look
      return true;
    }

    // So many pushes will succeed; more may, since the other side only ever makes room. Never waits.
    ROWE_RT std::size_t room_at_least() noexcept {
      seen_head_ = ring_.head_.load(std::memory_order_acquire); // pairs with the release in pop and drain
      return static_cast<std::size_t>(mask_ + 1 - (tail_ - seen_head_));
    }

    producer(const producer&) = delete;
    producer& operator=(const producer&) = delete;

   private:
    friend class spsc_ring;
    producer(spsc_ring& ring, std::span<entry> entries, std::uint64_t first_index) noexcept
        : tail_{first_index},
          seen_head_{first_index},
          mask_{entries.size() - 1},
          entries_{entries.data()},
          ring_{ring} {}

    std::uint64_t tail_;      // the index of the next push; what the shared word says, without loading it
    std::uint64_t seen_head_; // never ahead of the real one, so a ring that seems to have room has it
    std::uint64_t mask_;
    entry* entries_;
    spsc_ring& ring_;
  };

  // The end that pops. One thread at a time, as above.
  class consumer {
   public:
    // Never waits, never allocates. Nothing when the ring is empty.
    [[nodiscard]] ROWE_RT std::optional<T> try_pop() noexcept {
      if (head_ == seen_tail_) {
        look();
        if (head_ == seen_tail_) return std::nullopt;
      }
      const T item = entries_[head_ & mask_].load();
      ++head_;
      ring_.head_.store(head_, std::memory_order_release); // pairs with the acquires in producer
      return item;
    }

    // Calls `take(const T&)` for what was pushed before the call, oldest first, at most `items_max` of it;
    // returns how many. The places are given back together at the end, which spares the producer's core a
    // line transfer an item. `take` must neither throw nor use this end. As real-time safe as `take` is;
    // never waits of itself.
    template <class Take>
    ROWE_RT std::size_t drain(Take&& take, std::size_t items_max) noexcept {
      if (seen_tail_ - head_ < items_max) look();
      const std::uint64_t count = std::min<std::uint64_t>(seen_tail_ - head_, items_max);
      if (count == 0) return 0;
      for (const std::uint64_t end = head_ + count; head_ != end; ++head_) {
        const T& item = entries_[head_ & mask_].load();
        take(item);
      }
      ring_.head_.store(head_, std::memory_order_release); // pairs with the acquires in producer
      return static_cast<std::size_t>(count);
    }

    // So many pops will succeed; more may, since the other side only ever adds. Never waits.
    ROWE_RT std::size_t waiting_at_least() noexcept {
      look();
      return static_cast<std::size_t>(seen_tail_ - head_);
    }

    consumer(const consumer&) = delete;
    consumer& operator=(const consumer&) = delete;

   private:
    friend class spsc_ring;
    consumer(spsc_ring& ring, std::span<entry> entries, std::uint64_t first_index) noexcept
        : head_{first_index},
          seen_tail_{first_index},
          mask_{entries.size() - 1},
          entries_{entries.data()},
          ring_{ring} {}

    void look() noexcept {
      seen_tail_ = ring_.tail_.load(std::memory_order_acquire); // pairs with the release in try_push
    }

    std::uint64_t head_;      // the index of the next pop; what the shared word says, without loading it
    std::uint64_t seen_tail_; // never ahead of the real one, so an item that seems to be there is
    std::uint64_t mask_;
    entry* entries_;
    spsc_ring& ring_;
  };

  // Set-up, any thread. Each end is given out once; nullptr afterwards. The pointer is good as long as the
  // ring is.
  producer* take_producer() noexcept {
    return producer_taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : &producer_;
  }
  consumer* take_consumer() noexcept {
    return consumer_taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : &consumer_;
  }

  ROWE_RT std::size_t capacity() const noexcept { return static_cast<std::size_t>(producer_.mask_ + 1); }

  // Any thread, never waits; for counters, not for decisions. How many items there were at some time during
  // the call, give or take what both ends did meanwhile; never more than capacity().
  ROWE_RT std::size_t approximate_size() const noexcept {
    // acquire: pairs with the release in pop and drain; a tail loaded after that head is not before it
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed); // relaxed: no item is read by it
    return static_cast<std::size_t>(std::min(tail - head, producer_.mask_ + 1));
  }

  // The invariant that is broken, or nullptr. Only while no thread is inside either end.
  const char* check() const noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_acquire); // pairs with the release in try_push
    const std::uint64_t head =
        head_.load(std::memory_order_acquire); // pairs with the release in pop and drain
    if (producer_.mask_ != consumer_.mask_ || producer_.entries_ != consumer_.entries_)
      return "both ends see the same entries";
    if (!std::has_single_bit(producer_.mask_ + 1)) return "there are a power of two of entries";
    if (tail != producer_.tail_) return "the tail that is shared is the producer's own";
    if (head != consumer_.head_) return "the head that is shared is the consumer's own";
    if (tail - head > producer_.mask_ + 1) return "no more items wait than there are places";
    if (tail - producer_.seen_head_ > producer_.mask_ + 1)
      return "the producer has seen no head ahead of the real one";
    if (consumer_.seen_tail_ - head > tail - head)
      return "the consumer has seen no tail ahead of the real one";
    return nullptr;
  }

 private:
  alignas(line_bytes) producer producer_;
  typename Atomics::template variable<bool> producer_taken_{false};
  alignas(line_bytes) consumer consumer_;
  typename Atomics::template variable<bool> consumer_taken_{false};
  alignas(line_bytes) word tail_; // written by the producer
  alignas(line_bytes) word head_; // written by the consumer
};

} // namespace rowe::rt
