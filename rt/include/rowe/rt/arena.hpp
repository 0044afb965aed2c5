// SPDX-License-Identifier: Apache-2.0
// All memory that a loop will touch, taken during set-up: one anonymous mapping, every page present before
// the first cycle that uses it, locked if the system allows it. Parts are carved off its front and never
// freed singly; the mapping goes when the arena does.
//
// The mapping is MAP_SHARED, because the pages of a private one, locked or not, become copy-on-write again
// with each fork() of the process and fault at the next store (tests/rt/arena_test.cpp shows both). A child
// therefore sees the parent's memory, not a copy; programs that fork to run others do not notice.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// Whether the pages must stay in memory. `attempted` needs RLIMIT_MEMLOCK (8 MiB for ordinary users of
// Debian) or CAP_IPC_LOCK; without them the arena works, and says so. `in_parts`: a page takes no memory
// before prepare_part() has been called for it.
enum class page_lock : std::uint8_t { none, attempted, in_parts };

// Set-up, one thread at a time; what was carved may be used by any.
class arena {
 public:
  // An arena without memory.
  arena() noexcept = default;

  // Maps `bytes`, rounded up to whole pages, writes every page once but with `in_parts`, and locks them if
  // asked to. Enters the kernel. On failure the arena is empty and map_errno() says why; failing to lock is
  // reported by lock_errno(), and is no failure.
  arena(std::size_t bytes, page_lock lock) noexcept;

  arena(arena&& other) noexcept
      : base_{std::exchange(other.base_, nullptr)},
        bytes_total_{std::exchange(other.bytes_total_, 0)},
        bytes_used_{std::exchange(other.bytes_used_, 0)},
        map_errno_{other.map_errno_},
        lock_errno_{other.lock_errno_},
        locked_{std::exchange(other.locked_, false)} {}
  arena& operator=(arena&& other) noexcept;
  ~arena();

  // Leaves the memory mapped, and locked, for as long as the process runs, and is empty: for whoever finds at
  // the end that somebody still looks at it.
  void abandon() noexcept { base_ = nullptr; }

  // In a child of fork(): puts a private copy in the place of the memory, which is the parent's as well, so
  // that what is written here changes nothing there. Enters the kernel, allocates nothing from the heap.
  // False if there is no memory for it: the memory can then be read only.
  bool separate_in_child() noexcept;

  explicit operator bool() const noexcept { return base_ != nullptr; }
  int map_errno() const noexcept { return map_errno_; } // of mmap or madvise; 0 when mapped
  bool locked() const noexcept { return locked_; }
  // Of a part of an arena `in_parts`: makes its pages present, and locks them if the system allows it. What
  // is in them stays; other threads may use what shares a page with the part. Enters the kernel. Set-up.
  struct prepared {
    int populate_errno = 0; // not 0: the pages cannot be had, and must not be used
    bool locked = false;    // false: they work all the same, and may be paged out
  };
  static prepared prepare_part(std::span<std::byte> part) noexcept;
  int lock_errno() const noexcept { return lock_errno_; } // of mlock; 0 when locked or not asked for

  // Every carving begins at a multiple of line_bytes and takes whole lines, so that no two share one and a
  // plan can add them up: this is what carve_bytes(bytes), carve<T>(count) and make<T>() take. For alignments
  // above line_bytes add the alignment.
  static constexpr std::size_t bytes_for(std::size_t bytes) noexcept {
    return (bytes + line_bytes - 1) / line_bytes * line_bytes;
  }
  template <class T>
  static constexpr std::size_t bytes_for(std::size_t count = 1) noexcept {
    return bytes_for(sizeof(T) * count);
  }

  // The next `bytes`, zero, aligned to `alignment` (a power of two up to a page) and at least to line_bytes.
  // Empty when they do not fit; then nothing was taken.
  std::span<std::byte> carve_bytes(std::size_t bytes, std::size_t alignment = line_bytes) noexcept;

  // `count` objects, value-initialised. Empty when they do not fit. Nothing is ever destroyed.
  template <class T>
  std::span<T> carve(std::size_t count) noexcept {
    static_assert(std::is_trivially_destructible_v<T> && std::is_default_constructible_v<T>);
    if (count > bytes_total_ / sizeof(T)) return {};
    const std::span<std::byte> bytes = carve_bytes(count * sizeof(T), alignof(T));
    if (bytes.empty()) return {};
    T* const first = reinterpret_cast<T*>(bytes.data());
    std::uninitialized_value_construct_n(first, count);
    return {std::launder(first), count};
  }

  // One object, built from `arguments`: rings and windows, which do not move. nullptr when it does not fit.
  template <class T, class... Arguments>
  T* make(Arguments&&... arguments) noexcept {
    static_assert(std::is_trivially_destructible_v<T> && std::is_nothrow_constructible_v<T, Arguments...>);
    const std::span<std::byte> bytes = carve_bytes(sizeof(T), alignof(T));
    if (bytes.empty()) return nullptr;
    return std::construct_at(reinterpret_cast<T*>(bytes.data()), std::forward<Arguments>(arguments)...);
  }

  std::size_t bytes_total() const noexcept { return bytes_total_; }
  std::size_t bytes_used() const noexcept { return bytes_used_; }

 private:
  std::byte* base_ = nullptr;
  std::size_t bytes_total_ = 0;
  std::size_t bytes_used_ = 0;
  int map_errno_ = 0;
  int lock_errno_ = 0;
  bool locked_ = false;
};

} // namespace rowe::rt
