// SPDX-License-Identifier: Apache-2.0
// Slots of one size in one region of memory, named by number. Which of them are free is said elsewhere: a
// slot that travels between threads goes by spsc_ring and free_ring, and is free while its number lies in the
// latter.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// Room before a payload, for headers that are written when the payload is already there; and behind it, where
// a parser that works in wide steps may read (never write).
inline constexpr std::size_t headroom_bytes = 16;
inline constexpr std::size_t tailroom_bytes = 64;

// A payload begins at a multiple of this.
inline constexpr std::size_t payload_alignment = 16;

// A view of a region divided into slots; copies see the same slots. Any thread; its user decides who may
// touch which slot. Nothing waits or allocates.
class slab {
 public:
  // How far one slot is from the next: a multiple of line_bytes, so that no two share a line.
  static constexpr std::size_t stride_for(std::size_t payload_bytes) noexcept {
    return (headroom_bytes + payload_bytes + tailroom_bytes + line_bytes - 1) / line_bytes * line_bytes;
  }
  static constexpr std::size_t bytes_for(std::uint32_t slot_count, std::size_t payload_bytes) noexcept {
    return slot_count * stride_for(payload_bytes);
  }

  // A slab without slots.
  constexpr slab() noexcept = default;

  // Set-up. `region` is zero, aligned to line_bytes, at least bytes_for(slots, payload_bytes) long, and
  // outlives this.
  slab(std::span<std::byte> region, std::uint32_t slot_count, std::size_t payload_bytes) noexcept
      : base_{region.data()},
        stride_{stride_for(payload_bytes)},
        payload_bytes_{payload_bytes},
        slots_{slot_count} {
    assert(region.size() >= bytes_for(slot_count, payload_bytes));
    assert(reinterpret_cast<std::uintptr_t>(base_) % line_bytes == 0);
  }

  // The payload of slot `number`: payload_bytes(), with headroom before and tailroom behind it.
  ROWE_RT std::span<std::byte> slot(std::uint32_t number) const noexcept {
    assert(number < slots_);
    return {base_ + number * stride_ + headroom_bytes, payload_bytes_};
  }

  ROWE_RT std::uint32_t slot_count() const noexcept { return slots_; }
  ROWE_RT std::size_t payload_bytes() const noexcept { return payload_bytes_; }

  // The invariant that is broken, or nullptr. Reads every slot's end: only while nobody writes to them.
  const char* check() const noexcept;

 private:
  std::byte* base_ = nullptr;
  std::size_t stride_ = line_bytes;
  std::size_t payload_bytes_ = 0;
  std::uint32_t slots_ = 0;
};

} // namespace rowe::rt
