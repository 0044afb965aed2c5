// SPDX-License-Identifier: Apache-2.0
// A heap inside a given region of memory, for a library that allocates and frees in its own order and must
// not get more than that region. Every call takes a bounded number of steps, whatever was allocated before
// (two-level segregated fit): free blocks are in lists by size, four lists to each power of two; a bit says
// which lists have blocks; free neighbours are joined at once.
//
// One thread at a time; nothing here waits or enters the kernel.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rowe::net {

class fixed_heap {
 public:
  static constexpr std::size_t alignment = 16;
  static constexpr std::size_t region_bytes_max = std::size_t{1} << 30;

  // A heap without memory.
  fixed_heap() noexcept = default;
  // `region` is aligned to `alignment`, no longer than region_bytes_max, and outlives this.
  explicit fixed_heap(std::span<std::byte> region) noexcept;

  // nullptr, counted, if no free block is certain to be large enough.
  void* take(std::size_t bytes) noexcept;
  // As realloc(): `held` is nullptr or was taken here. On nullptr it is untouched.
  void* resize(void* held, std::size_t bytes) noexcept;
  void give(void* held) noexcept;

  bool owns(const void* address) const noexcept;
  // Whether take(bytes) would succeed now. If so, several smaller calls succeed, too, if their sum, with
  // `alignment` added to each, is at most three quarters of it.
  bool has_room_for(std::size_t bytes) const noexcept;

  std::size_t bytes_used() const noexcept { return bytes_used_; } // with what the heap itself needs for them
  std::size_t bytes_peak() const noexcept { return bytes_peak_; }
  std::uint64_t allocations() const noexcept { return allocations_; }
  std::uint64_t refusals() const noexcept { return refusals_; }

  // The invariant that is broken, or nullptr. Walks all blocks.
  const char* check() const noexcept;

 private:
  struct block;
  static constexpr std::size_t lists = 112; // to blocks of 2^32 bytes
  static std::size_t list_of(std::size_t bytes) noexcept;
  std::size_t first_list_for(std::size_t bytes) const noexcept;
  void link(block& free) noexcept;
  void unlink(block& free) noexcept;
  void cut(block& taken, std::size_t bytes) noexcept;

  std::byte* begin_ = nullptr;
  std::byte* end_ = nullptr; // where the last block, which is none, stands
  std::array<block*, lists> free_{};
  std::array<std::uint64_t, 2> any_{}; // a bit for each list
  std::size_t bytes_used_ = 0;
  std::size_t bytes_peak_ = 0;
  std::uint64_t allocations_ = 0;
  std::uint64_t refusals_ = 0;
};

} // namespace rowe::net
