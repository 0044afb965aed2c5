// SPDX-License-Identifier: Apache-2.0
#include "net/lws/fixed_heap.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <memory>

namespace rowe::net {

// Stands before what it hands out. A free block keeps its links where the bytes of a taken one would be.
struct fixed_heap::block {
  std::size_t bytes = 0;   // of the whole block, a multiple of the alignment
  block* before = nullptr; // its neighbour in memory that is free, or nullptr
  block* next = nullptr;   // in its list, while it is free
  block* previous = nullptr;

  static constexpr std::size_t header_bytes = 2 * sizeof(void*);

  static block& at(std::byte* place) noexcept { return *reinterpret_cast<block*>(place); }
  static block& of(void* held) noexcept { return at(static_cast<std::byte*>(held) - header_bytes); }
  std::byte* place() noexcept { return reinterpret_cast<std::byte*>(this); }
  void* payload() noexcept { return place() + header_bytes; }
  block& after() noexcept { return at(place() + bytes); }
};

namespace {

constexpr std::size_t least_block_bytes = 32;
constexpr unsigned least_power = 5; // 2^5 == least_block_bytes
constexpr unsigned parts_power = 2; // lists to each power of two

} // namespace

static_assert(sizeof(void*) == 8, "a header is as long as the alignment");

fixed_heap::fixed_heap(std::span<std::byte> region) noexcept {
  static_assert(sizeof(block) == least_block_bytes && block::header_bytes == alignment);
  assert(reinterpret_cast<std::uintptr_t>(region.data()) % alignment == 0);
  assert(region.size() <= region_bytes_max);
  const std::size_t whole = region.size() / alignment * alignment;
  if (whole < least_block_bytes + block::header_bytes) return;
  begin_ = region.data();
  end_ = begin_ + whole - block::header_bytes;
  block& all = *std::construct_at(&block::at(begin_));
  all.bytes = whole - block::header_bytes;
  // The block at the end is only a header; it counts as taken for ever.
  block& last = all.after();
  last.bytes = 0;
  link(all);
}

// The list for free blocks of so many bytes.
std::size_t fixed_heap::list_of(std::size_t bytes) noexcept {
  const auto power = static_cast<unsigned>(std::bit_width(bytes) - 1);
  const std::size_t part = (bytes >> (power - parts_power)) & ((1U << parts_power) - 1);
  return ((power - least_power) << parts_power) + part;
}

// The first list that has blocks, all of them large enough; `lists` if there is none.
std::size_t fixed_heap::first_list_for(std::size_t bytes) const noexcept {
  // Rounds up to the smallest size of the next list, so the first block of a list is always large enough.
  const auto power = static_cast<unsigned>(std::bit_width(bytes) - 1);
  const std::size_t list = list_of(bytes + (std::size_t{1} << (power - parts_power)) - 1);
  for (std::size_t word = list / 64; word < any_.size(); ++word) {
    const std::uint64_t from = word == list / 64 ? ~std::uint64_t{0} << (list % 64) : ~std::uint64_t{0};
    if (const std::uint64_t found = any_[word] & from; found != 0)
      return word * 64 + static_cast<std::size_t>(std::countr_zero(found));
  }
  return lists;
}

void fixed_heap::link(block& free) noexcept {
  free.after().before = &free;
  const std::size_t list = list_of(free.bytes);
  free.previous = nullptr;
  free.next = free_[list];
  if (free.next) free.next->previous = &free;
  free_[list] = &free;
  any_[list / 64] |= std::uint64_t{1} << (list % 64);
}

void fixed_heap::unlink(block& free) noexcept {
  free.after().before = nullptr;
  const std::size_t list = list_of(free.bytes);
  if (free.next) free.next->previous = free.previous;
  if (free.previous)
    free.previous->next = free.next;
  else
    free_[list] = free.next;
  if (!free_[list]) any_[list / 64] &= ~(std::uint64_t{1} << (list % 64));
}

// Shortens a block that is in no list to `bytes`; the rest becomes free.
void fixed_heap::cut(block& taken, std::size_t bytes) noexcept {
  if (taken.bytes - bytes < least_block_bytes) return;
  block& rest = *std::construct_at(&block::at(taken.place() + bytes));
  rest.bytes = taken.bytes - bytes;
  taken.bytes = bytes;
  link(rest);
}

namespace {

// The size of a block for so many bytes; 0 if that exceeds every region.
std::size_t block_bytes_for(std::size_t bytes) noexcept {
  if (bytes > fixed_heap::region_bytes_max) return 0;
  constexpr std::size_t mask = fixed_heap::alignment - 1;
  return std::max(((bytes + mask) & ~mask) + fixed_heap::alignment, least_block_bytes);
}

} // namespace

void* fixed_heap::take(std::size_t bytes) noexcept {
  const std::size_t needed = block_bytes_for(bytes);
  const std::size_t list = needed == 0 ? lists : first_list_for(needed);
  if (list == lists) {
    ++refusals_;
    return nullptr;
  }
  block& taken = *free_[list];
  unlink(taken);
  cut(taken, needed);
  bytes_used_ += taken.bytes;
  bytes_peak_ = std::max(bytes_peak_, bytes_used_);
  ++allocations_;
  return taken.payload();
}

void fixed_heap::give(void* held) noexcept {
  if (!held) return;
  assert(owns(held));
  block* given = &block::of(held);
  bytes_used_ -= given->bytes;
  if (block& after = given->after(); after.bytes != 0 && after.after().before == &after) {
    unlink(after);
    given->bytes += after.bytes;
  }
  if (block* const before = given->before) {
    unlink(*before);
    before->bytes += given->bytes;
    given = before;
  }
  link(*given);
}

void* fixed_heap::resize(void* held, std::size_t bytes) noexcept {
  if (!held) return take(bytes);
  const std::size_t before = block::of(held).bytes - block::header_bytes;
  void* const moved = take(bytes);
  if (!moved) return nullptr;
  std::memcpy(moved, held, std::min(before, bytes));
  give(held);
  return moved;
}

bool fixed_heap::owns(const void* address) const noexcept {
  const auto place = reinterpret_cast<std::uintptr_t>(address);
  return place >= reinterpret_cast<std::uintptr_t>(begin_) && place < reinterpret_cast<std::uintptr_t>(end_);
}

bool fixed_heap::has_room_for(std::size_t bytes) const noexcept {
  const std::size_t needed = block_bytes_for(bytes);
  return needed != 0 && first_list_for(needed) != lists;
}

const char* fixed_heap::check() const noexcept {
  if (!begin_) return bytes_used_ == 0 ? nullptr : "without memory nothing is used";
  std::size_t used = 0;
  std::size_t free_blocks = 0;
  block* before = nullptr; // the neighbour, if it is free
  std::byte* at = begin_;
  while (at < end_) {
    block& one = block::at(at);
    if (one.bytes < least_block_bytes || one.bytes % alignment != 0) return "a block has a size";
    if (at + one.bytes > end_) return "no block reaches beyond the end";
    if (one.before != before) return "a block knows whether its neighbour is free";
    const bool free = one.after().before == &one;
    if (free && before) return "free neighbours are joined";
    if (!free) used += one.bytes;
    if (free) ++free_blocks;
    before = free ? &one : nullptr;
    at += one.bytes;
  }
  if (used != bytes_used_) return "what is not free is used";
  for (std::size_t list = 0; list < lists; ++list) {
    if ((free_[list] != nullptr) != ((any_[list / 64] >> (list % 64) & 1) != 0))
      return "a bit tells whether its list has blocks";
    for (const block* one = free_[list]; one; one = one->next, --free_blocks)
      if (free_blocks == 0 || list_of(one->bytes) != list) return "each free block is in its list, once";
  }
  return free_blocks == 0 ? nullptr : "each free block is in a list";
}

} // namespace rowe::net
