// SPDX-License-Identifier: Apache-2.0
// Bounded queues of encoded messages, one for each peer and topic. The entries of all of them come from one
// pool, so that memory is bounded once and a queue costs nothing while it is empty. Service thread only.
#pragma once
#include <cassert>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/wire_slots.hpp"

namespace rowe::service {

struct queue {
  std::uint32_t head = no_index;
  std::uint32_t tail = no_index;
  std::uint32_t count = 0;
  std::uint64_t popped = 0; // since it exists

  bool empty() const noexcept { return head == no_index; }
};

class queue_entries {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<entry>(bounds.queued_max);
  }

  queue_entries(rt::arena& memory, const limits& bounds) noexcept
      : entries_{memory.carve<entry>(bounds.queued_max)} {
    for (std::uint32_t i = static_cast<std::uint32_t>(entries_.size()); i-- > 0;) {
      entries_[i].next = free_;
      free_ = i;
    }
  }

  // False when the pool is exhausted.
  bool push(queue& to, slot_ref slot) noexcept {
    if (free_ == no_index) return false;
    const std::uint32_t taken = free_;
    free_ = entries_[taken].next;
    entries_[taken] = {slot, no_index};
    if (to.empty()) {
      to.head = taken;
    } else {
      entries_[to.tail].next = taken;
    }
    to.tail = taken;
    ++to.count;
    ++in_use_;
    return true;
  }

  slot_ref front(const queue& of) const noexcept { return entries_[of.head].slot; }

  slot_ref pop(queue& from) noexcept {
    assert(!from.empty());
    const std::uint32_t popped = from.head;
    from.head = entries_[popped].next;
    if (from.empty()) from.tail = no_index;
    --from.count;
    ++from.popped;
    ++popped_;
    --in_use_;
    entries_[popped].next = free_;
    free_ = popped;
    return entries_[popped].slot;
  }

  // Walks a queue from its front without changing it: `at` begins as the queue's head and ends as no_index.
  slot_ref at(std::uint32_t position) const noexcept { return entries_[position].slot; }
  std::uint32_t after(std::uint32_t position) const noexcept { return entries_[position].next; }

  std::uint32_t in_use() const noexcept { return in_use_; }
  std::uint64_t popped() const noexcept { return popped_; } // of all queues, so far

 private:
  struct entry {
    slot_ref slot;
    std::uint32_t next = no_index;
  };

  std::span<entry> entries_;
  std::uint32_t free_ = no_index;
  std::uint32_t in_use_ = 0;
  std::uint64_t popped_ = 0;
};

} // namespace rowe::service
