// SPDX-License-Identifier: Apache-2.0
// A bounded queue from one thread to one other: every item arrives, in order, or the push is refused. Handles
// and the service thread pass slot numbers through it. Lamport's queue (Specifying Concurrent Program
// Modules, TOPLAS 1983) with two additions: each side keeps its own index in private memory, so that a push
// loads no line that the other side has just fetched, and each side remembers the other's index as it last
// saw it, so that it looks again only when the ring seems full (or empty). bench/hand_over.cpp
// compares a round trip with the plain transfer of the lines.
//
// Wait-free on both sides: try_push and try_pop are straight lines with one conditional second look, and
// neither contains a loop. Each end is a type that is given out once, so there cannot be a second producer.
// The ends live inside the ring, not in the handles that point to them, so moving a handle moves no index.
#pragma once
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

template <class T, class Atomics = std_atomics>
class spsc_ring;

// The end of a spsc_ring that pushes. One thread at a time; passing it to another thread needs
// synchronisation of its own. A base of the ring, so that the shared words lie at fixed distances and no load
// stands before theirs: a tenth to a quarter of a round trip between near cores, nothing between far ones
// (bench/hand_over.cpp).
template <class T, class Atomics>
class ring_producer {
  using entry = typename Atomics::template plain<T>;

 public:
  // Never waits, never allocates. False when all places are taken: nothing was pushed.
  [[nodiscard]] ROWE_RT bool try_push(const T& item) noexcept {
    if (tail_ - seen_head_ > mask_) {
      look();
      if (tail_ - seen_head_ > mask_) return false;
    }
    entries_[tail_ & mask_].store(item);
    ++tail_;
    // release: pairs with the acquire in ring_consumer::look
    ring().shared_tail_.store(tail_, std::memory_order_release);
    return true;
  }

  // So many pushes will succeed; more may, since the other side only ever makes room. Never waits.
  ROWE_RT std::size_t room_at_least() noexcept {
    look();
    return mask_ + 1 - (tail_ - seen_head_);
  }

  // How many the other side has popped so far, or more.
  std::uint64_t popped() noexcept {
    look();
    return seen_head_;
  }

  // How many the other side has not popped, at most; what it popped lately may be among them. Loads no shared
  // word.
  std::size_t unpopped_at_most() const noexcept { return tail_ - seen_head_; }
  // Calls `take(const T&)` for each of them, the oldest first, after a look at what is popped. Never waits.
  template <class Take>
  void each_unpopped(Take&& take) noexcept {
    look();
    for (std::uint64_t i = seen_head_; i != tail_; ++i) take(entries_[i & mask_].load());
  }

  ring_producer(const ring_producer&) = delete;
  ring_producer& operator=(const ring_producer&) = delete;

 private:
  friend class spsc_ring<T, Atomics>;
  ring_producer(std::span<entry> entries, std::uint64_t first_index) noexcept
      : tail_{first_index}, seen_head_{first_index}, mask_{entries.size() - 1}, entries_{entries.data()} {}

  spsc_ring<T, Atomics>& ring() noexcept { return static_cast<spsc_ring<T, Atomics>&>(*this); }
  void look() noexcept {
    // acquire: pairs with the releases in try_pop and drain, so that what is overwritten has been read
    seen_head_ = ring().shared_head_.load(std::memory_order_acquire);
  }

  // The index of the next push, which is what the shared word says; kept here so as not to load its line.
  alignas(line_bytes) std::uint64_t tail_;
  std::uint64_t seen_head_; // never ahead of the real one, so a ring that seems to have room has it
  std::uint64_t mask_;
  entry* entries_;
  typename Atomics::template variable<bool> taken_{false};
};

// The end of a spsc_ring that pops. One thread at a time, as above.
template <class T, class Atomics>
class ring_consumer {
  using entry = typename Atomics::template plain<T>;

 public:
  // Never waits, never allocates. Nothing when the ring is empty.
  [[nodiscard]] ROWE_RT std::optional<T> try_pop() noexcept {
    if (head_ == seen_tail_) {
      look();
      if (head_ == seen_tail_) return std::nullopt;
    }
    const T item = entries_[head_ & mask_].load();
    ++head_;
    // release: pairs with the acquire in ring_producer::look
    ring().shared_head_.store(head_, std::memory_order_release);
    return item;
  }

  // Calls `take(const T&)` for what was pushed before the call, oldest first, at most `items_max` of it;
  // returns how many. The places are given back together at the end, which spares the producer's core a line
  // transfer an item. `take` must neither throw nor use this end. As real-time safe as `take` is; never waits
  // of itself.
  template <class Take>
  ROWE_RT std::size_t drain(Take&& take, std::size_t items_max) noexcept {
    if (seen_tail_ - head_ < items_max) look();
    const std::uint64_t there = seen_tail_ - head_;
    const std::uint64_t count = there < items_max ? there : items_max;
    if (count == 0) return 0;
    for (const std::uint64_t end = head_ + count; head_ != end; ++head_) {
      const T& item = entries_[head_ & mask_].load();
      take(item);
    }
    // release: pairs with the acquire in ring_producer::look
    ring().shared_head_.store(head_, std::memory_order_release);
    return static_cast<std::size_t>(count);
  }

  // So many pops will succeed; more may, since the other side only ever adds. Never waits.
  ROWE_RT std::size_t pending_at_least() noexcept {
    look();
    return seen_tail_ - head_;
  }

  // How many the other side has pushed so far, or more.
  std::uint64_t pushed() noexcept {
    look();
    return seen_tail_;
  }

  ring_consumer(const ring_consumer&) = delete;
  ring_consumer& operator=(const ring_consumer&) = delete;

 private:
  friend class spsc_ring<T, Atomics>;
  ring_consumer(std::span<entry> entries, std::uint64_t first_index) noexcept
      : head_{first_index}, seen_tail_{first_index}, mask_{entries.size() - 1}, entries_{entries.data()} {}

  spsc_ring<T, Atomics>& ring() noexcept { return static_cast<spsc_ring<T, Atomics>&>(*this); }
  void look() noexcept {
    // acquire: pairs with the release in try_push, so that what is read has been written
    seen_tail_ = ring().shared_tail_.load(std::memory_order_acquire);
  }

  // The index of the next pop, which is what the shared word says; kept here so as not to load its line.
  alignas(line_bytes) std::uint64_t head_;
  std::uint64_t seen_tail_; // never ahead of the real one, so an item that seems to be there is
  std::uint64_t mask_;
  entry* entries_;
  typename Atomics::template variable<bool> taken_{false};
};

// T is copied in and out. Neither copied nor moved itself; has nothing to destroy, so that memory that held a
// ring may be built anew when no thread uses it any more.
template <class T, class Atomics>
class spsc_ring : ring_producer<T, Atomics>, ring_consumer<T, Atomics> {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  using value_type = T;
  using entry = typename Atomics::template plain<T>;
  using producer = ring_producer<T, Atomics>;
  using consumer = ring_consumer<T, Atomics>;

  // How many entries a ring needs that holds `items`: the next power of two.
  static constexpr std::size_t places_for(std::size_t items) noexcept { return std::bit_ceil(items); }

  // Set-up. `entries` are a power of two, need no initial value, and outlive the ring. Indices begin at
  // `first_index`, so that a test can stand close to where they wrap.
  explicit spsc_ring(std::span<entry> entries, std::uint64_t first_index = 0) noexcept
      : producer{entries, first_index},
        consumer{entries, first_index},
        shared_tail_{first_index},
        shared_head_{first_index} {
    assert(std::has_single_bit(entries.size()));
  }
  spsc_ring(const spsc_ring&) = delete;
  spsc_ring& operator=(const spsc_ring&) = delete;

  // Set-up, any thread. Each end is given out once; nullptr afterwards. The pointer is good as long as the
  // ring is.
  producer* take_producer() noexcept {
    return producer::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }
  consumer* take_consumer() noexcept {
    return consumer::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }

  ROWE_RT std::size_t capacity() const noexcept { return static_cast<std::size_t>(producer::mask_ + 1); }

  // Any thread, never waits; for counters, not for decisions. How many items there were at some time during
  // the call, give or take what both ends did meanwhile; never more than capacity().
  ROWE_RT std::size_t approximate_size() const noexcept {
    // acquire: pairs with the releases in ring_consumer; a tail loaded after that head is not before it
    const std::uint64_t head = shared_head_.load(std::memory_order_acquire);
    const std::uint64_t tail = shared_tail_.load(std::memory_order_relaxed); // relaxed: no item is read by it
    const std::uint64_t places = producer::mask_ + 1;
    return tail - head < places ? tail - head : places;
  }

  // The invariant that is broken, or nullptr. Only while no thread is inside either end.
  const char* check() const noexcept {
    // acquire: pair with the releases in try_push, and in try_pop and drain
    const std::uint64_t tail = shared_tail_.load(std::memory_order_acquire);
    const std::uint64_t head = shared_head_.load(std::memory_order_acquire);
    const std::uint64_t places = producer::mask_ + 1;
    if (producer::mask_ != consumer::mask_ || producer::entries_ != consumer::entries_)
      return "both ends see the same entries";
    if (!std::has_single_bit(places)) return "there are a power of two of entries";
    if (tail != producer::tail_) return "the tail that is shared is the producer's own";
    if (head != consumer::head_) return "the head that is shared is the consumer's own";
    if (tail - head > places) return "no more items wait than there are places";
    if (tail - producer::seen_head_ > places) return "the producer has seen no head ahead of the real one";
    if (consumer::seen_tail_ - head > tail - head)
      return "the consumer has seen no tail ahead of the real one";
    return nullptr;
  }

 private:
  friend producer;
  friend consumer;
  using word = typename Atomics::template variable<std::uint64_t>;

  alignas(line_bytes) word shared_tail_; // written by the producer
  alignas(line_bytes) word shared_head_; // written by the consumer
};

} // namespace rowe::rt
