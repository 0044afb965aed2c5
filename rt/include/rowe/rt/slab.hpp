// SPDX-License-Identifier: Apache-2.0
// Slots of one size in one region of memory, named by number; and the pool that says which of them are free,
// for slots that one thread alone takes and gives back. A slot that travels between threads goes by ring and
// home_ring instead, and is then free when its number is at home.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// Room before a payload, for headers that are written when the payload is already there; and behind it, where
// a parser that works in wide steps may read (never write).
inline constexpr std::size_t headroom_bytes = 16;
inline constexpr std::size_t tailroom_bytes = 64;

// A payload begins at a multiple of this.
inline constexpr std::size_t payload_alignment = 16;

// A view of a region divided into slots; copies see the same slots. Any thread; who may touch which slot is
// its user's affair. Nothing waits or allocates.
class slab {
 public:
  // How far one slot is from the next: a multiple of line_bytes, so that no two share a line.
  static constexpr std::size_t stride_for(std::size_t payload_bytes) noexcept {
    return (headroom_bytes + payload_bytes + tailroom_bytes + line_bytes - 1) / line_bytes * line_bytes;
  }
  static constexpr std::size_t bytes_for(std::uint32_t slots, std::size_t payload_bytes) noexcept {
    return slots * stride_for(payload_bytes);
  }

  // A slab without slots.
  constexpr slab() noexcept = default;

  // Set-up. `region` is zero, aligned to line_bytes, at least bytes_for(slots, payload_bytes) long, and
  // outlives this.
  slab(std::span<std::byte> region, std::uint32_t slots, std::size_t payload_bytes) noexcept
      : base_{region.data()},
        stride_{stride_for(payload_bytes)},
        payload_bytes_{payload_bytes},
        slots_{slots} {
    assert(region.size() >= bytes_for(slots, payload_bytes));
    assert(reinterpret_cast<std::uintptr_t>(base_) % line_bytes == 0);
  }

  // The payload of slot `number`: payload_bytes(), with headroom before and tailroom behind it.
  ROWE_RT std::span<std::byte> slot(std::uint32_t number) const noexcept {
    assert(number < slots_);
    return {base_ + number * stride_ + headroom_bytes, payload_bytes_};
  }

  // The slot in whose stride `address` lies, or nothing when it lies in none.
  ROWE_RT std::optional<std::uint32_t> number_of(const void* address) const noexcept {
    const auto offset = reinterpret_cast<std::uintptr_t>(address) - reinterpret_cast<std::uintptr_t>(base_);
    if (slots_ == 0 || offset >= slots_ * stride_)
      return std::nullopt; // an address before base_ wraps to a large one
    return static_cast<std::uint32_t>(offset / stride_);
  }

  ROWE_RT std::uint32_t slots() const noexcept { return slots_; }
  ROWE_RT std::size_t payload_bytes() const noexcept { return payload_bytes_; }
  ROWE_RT std::size_t stride_bytes() const noexcept { return stride_; }

  // The invariant that is broken, or nullptr. Reads every slot's end: only while nobody writes to them.
  const char* check() const noexcept;

 private:
  std::byte* base_ = nullptr;
  std::size_t stride_ = line_bytes;
  std::size_t payload_bytes_ = 0;
  std::uint32_t slots_ = 0;
};

// A slot taken from a pool. The generation tells it from earlier and later uses of the same slot, so that a
// copy kept too long is found out instead of reaching someone else's data.
struct pool_ticket {
  std::uint32_t number = 0;
  std::uint32_t generation = 0; // odd while taken; 0 in no ticket that was ever given out
  friend bool operator==(const pool_ticket&, const pool_ticket&) = default;
};

// Which slots are free: a stack of numbers, plain integers, one thread. Wait-free by being sequential: taking
// and giving are a few instructions without a loop. The slot given back last is taken first, while it is
// still in the cache. A ticket is told from a stale one unless its slot was taken 2^31 times in between.
class pool {
 public:
  struct node {
    std::uint32_t next = 0;
    std::uint32_t generation = 0; // odd while taken
  };

  // A pool without slots.
  constexpr pool() noexcept = default;

  // Set-up. One node a slot; all slots are free. The nodes outlive this.
  explicit pool(std::span<node> nodes) noexcept;

  // Never waits, never allocates. Nothing when all slots are taken.
  [[nodiscard]] ROWE_RT std::optional<pool_ticket> take() noexcept {
    if (free_count_ == 0) return std::nullopt;
    const std::uint32_t number = first_;
    node& taken = nodes_[number];
    first_ = taken.next;
    --free_count_;
    ++taken.generation;
    return pool_ticket{number, taken.generation};
  }

  // Gives a slot back. A stale ticket is a programmer's error: asserted in dev builds; otherwise false, and
  // nothing happens. Never waits, never allocates.
  ROWE_RT bool give(pool_ticket ticket) noexcept {
    const bool right = holds(ticket);
    assert(right);
    if (!right) return false;
    node& given = nodes_[ticket.number];
    ++given.generation;
    given.next = first_;
    first_ = ticket.number;
    ++free_count_;
    return true;
  }

  // Whether the ticket's slot is taken and still in the use for which the ticket was given out.
  ROWE_RT bool holds(pool_ticket ticket) const noexcept {
    return ticket.number < nodes_.size() && (ticket.generation & 1U) != 0 &&
           nodes_[ticket.number].generation == ticket.generation;
  }

  ROWE_RT std::uint32_t slots() const noexcept { return static_cast<std::uint32_t>(nodes_.size()); }
  ROWE_RT std::uint32_t free_count() const noexcept { return free_count_; }

  // The invariant that is broken, or nullptr. Walks all nodes.
  const char* check() const noexcept;

 private:
  std::span<node> nodes_;
  std::uint32_t first_ = 0; // of the free ones; meaningless when there is none
  std::uint32_t free_count_ = 0;
};

} // namespace rowe::rt
