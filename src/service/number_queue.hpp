// SPDX-License-Identifier: Apache-2.0
// Numbers of slots that any number of threads put and take, by moodycamel's ConcurrentQueue. There a producer
// may only be used by one thread at a time. A producer for each thread cannot be bounded, and one from a
// common set would have to be locked. So there is a producer for each *slot*: whoever holds a slot, and that
// is one thread at any time, puts its number by the slot's own producer. Each holds one number at most, so
// its first block serves for ever and nothing is allocated, however many threads come and go
// (number_queue.cpp says how the memory is taken from the arena).
//
// Order is kept only within one producer. Each slot has a producer of its own, so the numbers come in any
// order. A user who needs one adds tickets (submission_queue.hpp).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rowe/rt/arena.hpp>

namespace rowe::service {

// Nothing waits or allocates. Whoever takes a number acquires what its putter did before. Neither copied nor
// moved; nothing to destroy, so it may lie in the arena.
class number_queue {
 public:
  static std::size_t footprint_bytes(std::uint32_t slots) noexcept;
  // Set-up. The numbers of all slots are in it.
  number_queue(rt::arena& memory, std::uint32_t slots) noexcept;
  number_queue(const number_queue&) = delete;
  number_queue& operator=(const number_queue&) = delete;

  // The thread that holds the slot.
  void put(std::uint32_t slot) noexcept;
  // Any thread; a number may hide while others are taking. If there is one taker, it finds every number whose
  // put happened before.
  bool take(std::uint32_t& slot) noexcept;
  std::size_t take_all(std::span<std::uint32_t> into) noexcept;
  // Any thread: whether there is one, as far as it has heard of it.
  bool has_any() const noexcept;

  // Tests, when no thread is inside: takes all numbers out and puts them back. Returns whether each is that
  // of a slot that was not seen before; now it is. `count`: how many they are. Allocates.
  bool sees_each_once(std::vector<bool>& seen, std::size_t& count);

 private:
  struct storage; // moodycamel's queue and its producers

  storage* in_ = nullptr;
};

} // namespace rowe::service
