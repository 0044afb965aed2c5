// SPDX-License-Identifier: Apache-2.0
// The free ring of slot numbers: the borrower of a slot releases its number here, and the owner of the slots
// takes it out again. A number that lies here is *free*. It differs from spsc_ring in one thing, which makes
// it simpler and cheaper. It has at least as many places as there are slots, so a release never tests for
// full, and the taker publishes no head index.
//
// Why that is sound. A number is in at most one of four places: free, with the owner, in the ring that
// carries slots to the borrower, or with the borrower. The owner takes a number out of place p here, and then
// pushes the slot into that ring. The push is a release, and the borrower's pop an acquire. Only after that
// can the borrower release the number. Before place p is written again, as many numbers as there are places
// were released, so the number that lay in p had been taken and pushed. The order of the other ring thus puts
// the reading of p before the writing. This holds only for numbers that went through such a ring, one release
// for each take.
//
// Wait-free on both sides, as spsc_ring is. All numbers are free when it is built.
#pragma once
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

template <class Atomics = std_atomics>
class free_ring;

// The borrower's end of a free_ring. One thread at a time; passing it to another thread needs synchronisation
// of its own. A base of the ring, so that the shared word lies at a fixed distance and no load stands before
// its.
template <class Atomics>
class free_producer {
  using entry = typename Atomics::template plain<std::uint32_t>;

 public:
  // Releases a number that was sent out, once. Never waits, never allocates, cannot fail.
  ROWE_RT void release(std::uint32_t slot) noexcept {
    assert(slot < slots_);
    entries_[tail_ & mask_].store(slot);
    ++tail_;
    // release: pairs with the acquire in free_consumer::look
    ring().shared_tail_.store(tail_, std::memory_order_release);
  }

  free_producer(const free_producer&) = delete;
  free_producer& operator=(const free_producer&) = delete;

 private:
  friend class free_ring<Atomics>;
  free_producer(std::span<entry> entries, std::uint32_t slot_count, std::uint64_t first_index) noexcept
      : tail_{first_index + slot_count},
        mask_{entries.size() - 1},
        entries_{entries.data()},
        slots_{slot_count} {}

  free_ring<Atomics>& ring() noexcept { return static_cast<free_ring<Atomics>&>(*this); }

  // The index of the next release, which is what the shared word says; kept here so as not to load its line.
  alignas(line_bytes) std::uint64_t tail_;
  std::uint64_t mask_;
  entry* entries_;
  std::uint32_t slots_;
  typename Atomics::template variable<bool> taken_{false};
};

// The owner's end of a free_ring. One thread at a time, as above.
template <class Atomics>
class free_consumer {
  using entry = typename Atomics::template plain<std::uint32_t>;

 public:
  // A slot that is free now. Never waits, never allocates. Nothing when all slots are out.
  [[nodiscard]] ROWE_RT std::optional<std::uint32_t> try_take() noexcept {
    if (head_ == seen_tail_) {
      look();
      if (head_ == seen_tail_) return std::nullopt;
    }
    const std::uint32_t slot = entries_[head_ & mask_].load();
    ++head_;
    return slot;
  }

  // A mark behind the last number that is free now, for see(). Never waits.
  std::uint64_t mark() noexcept {
    look();
    return seen_tail_;
  }
  // Calls `each(slot)` for every number up to the mark that was released since the last call, in their order,
  // before it is taken; all stay to be taken. Those taken unseen are left out. Never waits.
  template <class Each>
  void see(std::uint64_t mark, Each&& each) noexcept {
    if (seen_by_owner() == 0) seen_here_ = head_;
    for (; seen_here_ != mark && mark - seen_here_ <= slots_; ++seen_here_)
      each(entries_[seen_here_ & mask_].load());
  }
  // How many of the numbers to be taken next were seen by see(), or have never been taken.
  std::size_t seen_by_owner() const noexcept {
    const std::uint64_t seen = seen_here_ - head_;
    return seen <= slots_ ? static_cast<std::size_t>(seen) : 0; // behind the head: those were taken unseen
  }

  // So many takes will succeed; more may, since the borrower only ever releases. Never waits.
  ROWE_RT std::size_t free_at_least() noexcept {
    look();
    return seen_tail_ - head_;
  }

  // How many takes and releases there were so far. There may be more releases already, since the borrower
  // goes on. The numbers that were there from the beginning do not count as released.
  std::uint64_t taken() const noexcept { return head_; }
  std::uint64_t released() noexcept {
    look();
    return seen_tail_ - slots_;
  }

  free_consumer(const free_consumer&) = delete;
  free_consumer& operator=(const free_consumer&) = delete;

 private:
  friend class free_ring<Atomics>;
  free_consumer(std::span<entry> entries, std::uint32_t slot_count, std::uint64_t first_index) noexcept
      : head_{first_index},
        seen_tail_{first_index + slot_count},
        seen_here_{first_index + slot_count},
        mask_{entries.size() - 1},
        entries_{entries.data()},
        slots_{slot_count} {}

  free_ring<Atomics>& ring() noexcept { return static_cast<free_ring<Atomics>&>(*this); }
  void look() noexcept {
    // acquire: pairs with the release in release(), so that the number read has been written
    seen_tail_ = ring().shared_tail_.load(std::memory_order_acquire);
    assert(seen_tail_ - head_ <= slots_); // else a number was released twice
  }

  // The index of the next take; nobody else needs it.
  alignas(line_bytes) std::uint64_t head_;
  std::uint64_t seen_tail_; // never ahead of the real one, so a number that seems to be there is
  std::uint64_t seen_here_; // the index of the next see()
  std::uint64_t mask_;
  entry* entries_;
  std::uint32_t slots_;
  typename Atomics::template variable<bool> taken_{false};
};

// Numbers 0 to slots - 1. Neither copied nor moved; nothing to destroy.
template <class Atomics>
class free_ring : free_producer<Atomics>, free_consumer<Atomics> {
 public:
  using number = std::uint32_t;
  using entry = typename Atomics::template plain<number>;
  using producer = free_producer<Atomics>;
  using consumer = free_consumer<Atomics>;

  // How many entries the ring for `slots` numbers should have: a power of two, with a line to spare.
  // Otherwise a number is released right behind the one that is taken next, and each take fetches the line
  // that the borrower has just written: one transfer a take instead of one a line (bench/publish.cpp).
  static constexpr std::size_t places_for(std::size_t slot_count) noexcept {
    return std::bit_ceil(slot_count + line_bytes / sizeof(entry));
  }

  // Set-up. `entries` are a power of two, at least `slots`, and outlive this; places_for() of them, aligned
  // to a line, are fastest. Indices begin at `first_index`.
  free_ring(std::span<entry> entries, std::uint32_t slot_count, std::uint64_t first_index = 0) noexcept
      : producer{entries, slot_count, first_index},
        consumer{entries, slot_count, first_index},
        shared_tail_{first_index + slot_count} {
    assert(std::has_single_bit(entries.size()) && entries.size() >= slot_count);
    for (std::uint32_t slot = 0; slot < slot_count; ++slot)
      entries[(first_index + slot) & (entries.size() - 1)].store(slot);
  }
  free_ring(const free_ring&) = delete;
  free_ring& operator=(const free_ring&) = delete;

  // Set-up, any thread. Each end is given out once; nullptr afterwards. The pointer is good as long as this
  // is.
  producer* take_producer() noexcept {
    return producer::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }
  consumer* take_consumer() noexcept {
    return consumer::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }

  ROWE_RT std::uint32_t slot_count() const noexcept { return consumer::slots_; }

  // The invariant that is broken, or nullptr. Only while no thread is inside either end. Looks at each pair
  // of free numbers, so it takes time in the square of `slots`.
  const char* check() const noexcept {
    const std::uint64_t tail =
        shared_tail_.load(std::memory_order_acquire); // pairs with the release in release()
    const std::uint64_t head = consumer::head_;
    const std::uint64_t mask = consumer::mask_;
    if (!std::has_single_bit(mask + 1) || mask + 1 < slot_count()) return "there is a place for every slot";
    if (tail != producer::tail_) return "the tail that is shared is the producer's own";
    if (tail - head > slot_count()) return "no more numbers are free than there are slots";
    if (consumer::seen_tail_ - head > tail - head)
      return "the consumer has seen no tail ahead of the real one";
    for (std::uint64_t i = head; i != tail; ++i) {
      const number slot = consumer::entries_[i & mask].load();
      if (slot >= slot_count()) return "a free number is that of a slot";
      for (std::uint64_t j = head; j != i; ++j)
        if (consumer::entries_[j & mask].load() == slot) return "no number is free twice";
    }
    return nullptr;
  }

 private:
  friend producer;
  friend consumer;

  alignas(line_bytes)
      typename Atomics::template variable<std::uint64_t> shared_tail_; // written by the producer
};

} // namespace rowe::rt
