// SPDX-License-Identifier: Apache-2.0
// Numbers of slots that any number of threads put and take, by moodycamel's ConcurrentQueue. There only one
// thread at a time may use a producer. Producers for threads are unbounded, and a common set of producers
// needs a lock. So there is a producer for each *slot*: one thread at a time holds a slot, and puts its
// number by the slot's own producer. A producer holds one number at most, so its first block is enough for
// ever. So nothing is allocated, however many threads come and go (number_queue.cpp says how the memory is
// taken from the arena).
//
// Order is kept only within one producer. Each slot has a producer of its own, so the numbers come in any
// order. A user that needs an order adds tickets (submission_queue.hpp).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rowe/rt/arena.hpp>

namespace rowe::service {

// Nothing waits or allocates. The thread that takes a number acquires what the thread that put it did before.
// Neither copied nor moved; nothing to destroy, so it may lie in the arena.
class number_queue {
 public:
  static std::size_t footprint_bytes(std::uint32_t slots) noexcept;
  // Set-up. The new queue has the numbers of all slots.
  number_queue(rt::arena& memory, std::uint32_t slots) noexcept;
  number_queue(const number_queue&) = delete;
  number_queue& operator=(const number_queue&) = delete;

  // The thread that holds the slot.
  void put(std::uint32_t slot) noexcept;
  // Any thread. While several threads take, one may miss a number. A single taker finds every number whose
  // put happened before.
  bool take(std::uint32_t& slot) noexcept;
  std::size_t take_all(std::span<std::uint32_t> into) noexcept;
  // Any thread: whether it sees a number. Others may be there.
  bool has_any() const noexcept;

  // Tests, when no thread is inside: takes all numbers out and puts them back. Returns whether each is that
  // of a slot that was not seen before; now it is. `count`: how many they are. Allocates.
  bool sees_each_once(std::vector<bool>& seen, std::size_t& count);

 private:
  struct storage; // moodycamel's queue and its producers

  storage* in_ = nullptr;
};

} // namespace rowe::service
