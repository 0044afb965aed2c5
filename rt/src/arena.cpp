// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/arena.hpp>

#include <bit>
#include <cassert>
#include <cerrno>
#include <cstring>

#include <sys/mman.h>
#include <unistd.h>

namespace rowe::rt {

namespace {

std::size_t page_bytes() noexcept { return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)); }

// Writes to every page, and changes nothing. Pages that cannot be had kill the process here, as they would at
// any later store.
void touch(std::byte* base, std::size_t bytes, std::size_t page) noexcept {
  // relaxed: only that the page is there matters
  for (std::size_t at = 0; at < bytes; at += page)
    __atomic_fetch_or(reinterpret_cast<unsigned char*>(base + at), 0, __ATOMIC_RELAXED);
}

// Makes every page present and writable; 0 or an errno. MAP_POPULATE alone reports nothing when memory runs
// out, and leaves the pages of a shared mapping to be marked as written by the first store.
int populate(std::byte* base, std::size_t bytes, std::size_t page) noexcept {
#if defined(MADV_POPULATE_WRITE)
  if (::madvise(base, bytes, MADV_POPULATE_WRITE) == 0) return 0;
  if (errno != EINVAL) return errno; // EINVAL: a kernel before 5.14, which does not know the advice
#endif
  touch(base, bytes, page);
  return 0;
}

} // namespace

arena::arena(std::size_t bytes, page_lock lock) noexcept {
  const std::size_t page = page_bytes();
  if (bytes == 0 || bytes > SIZE_MAX - page) {
    map_errno_ = EINVAL;
    return;
  }
  const std::size_t total = (bytes + page - 1) / page * page;
  const bool whole = lock != page_lock::in_parts;
  void* const mapped = ::mmap(nullptr, total, PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS | (whole ? MAP_POPULATE : 0), -1, 0);
  if (mapped == MAP_FAILED) {
    map_errno_ = errno;
    return;
  }
  auto* const base = static_cast<std::byte*>(mapped);
  if (const int reason = whole ? populate(base, total, page) : 0; reason != 0) {
    ::munmap(base, total);
    map_errno_ = reason;
    return;
  }
  if (lock == page_lock::attempted) {
    locked_ = ::mlock(base, total) == 0;
    lock_errno_ = locked_ ? 0 : errno;
  }
  base_ = base;
  bytes_total_ = total;
}

arena& arena::operator=(arena&& other) noexcept {
  if (this == &other) return *this;
  std::destroy_at(this);
  return *std::construct_at(this, std::move(other));
}

arena::~arena() {
  if (base_ != nullptr) ::munmap(base_, bytes_total_); // unlocks too
}

bool arena::separate_in_child() noexcept {
  if (base_ == nullptr) return true;
  void* const copy =
      ::mmap(nullptr, bytes_total_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (copy == MAP_FAILED) {
    (void)::mprotect(base_, bytes_total_, PROT_READ);
    return false;
  }
  std::memcpy(copy, base_, bytes_total_);
  if (::mremap(copy, bytes_total_, bytes_total_, MREMAP_MAYMOVE | MREMAP_FIXED, base_) != MAP_FAILED)
    return true;
  (void)::mprotect(base_, bytes_total_, PROT_READ);
  return false;
}

arena::prepared arena::prepare_part(std::span<std::byte> part) noexcept {
  if (part.empty()) return {.locked = true};
  const std::size_t page = page_bytes();
  const std::size_t before = reinterpret_cast<std::uintptr_t>(part.data()) % page;
  const std::size_t bytes = (before + part.size() + page - 1) / page * page;
  prepared done{.populate_errno = populate(part.data() - before, bytes, page)};
  done.locked = done.populate_errno == 0 && ::mlock(part.data() - before, bytes) == 0;
  return done;
}

std::span<std::byte> arena::carve_bytes(std::size_t bytes, std::size_t alignment) noexcept {
  assert(std::has_single_bit(alignment) && alignment <= page_bytes());
  if (alignment < line_bytes) alignment = line_bytes;
  const std::size_t begin = (bytes_used_ + alignment - 1) / alignment * alignment;
  // bytes_total_ is a multiple of line_bytes, so what fits fits rounded up to whole lines as well.
  if (bytes == 0 || begin > bytes_total_ || bytes > bytes_total_ - begin) return {};
  bytes_used_ = begin + bytes_for(bytes);
  return {base_ + begin, bytes};
}

} // namespace rowe::rt
