// SPDX-License-Identifier: Apache-2.0
// The heap's functions, defined in the executable and so in front of the C library's for everything in the
// process. Each records that it was called, then calls glibc's own function by the name that glibc has for
// this purpose.
#include "state.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <malloc.h>
#include <unistd.h>

extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* old, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void* __libc_valloc(std::size_t bytes);
void* __libc_pvalloc(std::size_t bytes);
void __libc_free(void* old);
}

namespace rowe::rt::tripwire {
namespace {

constinit std::atomic<std::uint64_t> allocations{0};

void note(const char* call) noexcept {
  allocations.fetch_add(
      1, std::memory_order_relaxed); // relaxed: pairs with the load below; only the number counts
  saw_allocation(call);
}

} // namespace

std::uint64_t process_allocations() noexcept {
  return allocations.load(std::memory_order_relaxed); // relaxed: pairs with the addition above
}

} // namespace rowe::rt::tripwire

using rowe::rt::tripwire::note;

extern "C" {

void* malloc(std::size_t bytes) noexcept {
  note("malloc");
  return __libc_malloc(bytes);
}

void* calloc(std::size_t count, std::size_t bytes) noexcept {
  note("calloc");
  return __libc_calloc(count, bytes);
}

void* realloc(void* old, std::size_t bytes) noexcept {
  note("realloc");
  return __libc_realloc(old, bytes);
}

void* reallocarray(void* old, std::size_t count, std::size_t bytes) noexcept {
  note("reallocarray");
  std::size_t product = 0;
  if (__builtin_mul_overflow(count, bytes, &product)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(old, product);
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  note("aligned_alloc");
  return __libc_memalign(alignment, bytes);
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  note("memalign");
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) noexcept {
  note("posix_memalign");
  const bool power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
  void* const got = __libc_memalign(alignment, bytes);
  if (got == nullptr) return ENOMEM;
  *memory = got;
  return 0;
}

void* valloc(std::size_t bytes) noexcept {
  note("valloc");
  return __libc_valloc(bytes);
}

void* pvalloc(std::size_t bytes) noexcept {
  note("pvalloc");
  return __libc_pvalloc(bytes);
}

void free(void* old) noexcept {
  if (old != nullptr) rowe::rt::tripwire::saw_allocation("free");
  __libc_free(old);
}

} // extern "C"
