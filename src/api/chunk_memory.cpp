// SPDX-License-Identifier: Apache-2.0
#include "api/chunk_memory.hpp"

#include <algorithm>
#include <cerrno>

#include <sys/mman.h>
#include <unistd.h>

namespace rowe::detail {
namespace {

// Nothing else says so: to drop the cached pages of what is locked is refused.
bool is_locked(std::byte* at, std::size_t bytes) noexcept {
  return ::msync(at, bytes, MS_ASYNC | MS_INVALIDATE) != 0 && errno == EBUSY;
}

} // namespace

chunk_memory::chunk_memory(std::size_t bytes) noexcept {
  void* const mapped = ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) {
    map_errno_ = errno;
  } else {
    bytes_ = {static_cast<std::byte*>(mapped), bytes};
  }
}

chunk_memory::~chunk_memory() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size()); // unlocks too
}

bool chunk_memory::open(std::size_t bytes) noexcept {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const std::size_t end = std::min((bytes + page - 1) / page * page, bytes_.size());
  if (end <= open_) return true;
  std::byte* const at = bytes_.data() + open_;
  const std::size_t more = end - open_;
  // Else all of it would be brought in here. Where this kernel cannot do that, it is.
  if (is_locked(at, more)) (void)::mlock2(at, more, MLOCK_ONFAULT);
  if (::mprotect(at, more, PROT_READ | PROT_WRITE) != 0) return false;
  open_ = end;
  return true;
}

} // namespace rowe::detail
