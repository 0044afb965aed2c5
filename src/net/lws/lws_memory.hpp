// SPDX-License-Identifier: Apache-2.0
// The memory that libwebsockets allocates from: one heap of a fixed size for each of our contexts, mapped,
// present and locked when the context is made.
//
// libwebsockets has one allocator for the whole process, and does not pass it the context. So our allocator
// uses the heap that was lent to the calling thread: a caller of libwebsockets lends the thread the heap of
// its context during the call (`lws_memory::lending`). A context is made on one thread and used on another,
// but never by two at once. So its heap needs no lock, and gets back all that was taken from it. All other
// calls, such as those of a program that uses libwebsockets itself, go to the C library.
#pragma once
#include <cstddef>

#include <rowe/rt/arena.hpp>

#include "net/lws/fixed_heap.hpp"

namespace rowe::net {

class lws_memory {
 public:
  // Without memory.
  lws_memory() noexcept = default;
  // Set-up: maps, locks if permitted, and on the process's first use installs the allocator. Empty when the
  // memory cannot be had.
  explicit lws_memory(std::size_t bytes) noexcept;
  explicit operator bool() const noexcept { return static_cast<bool>(region_); }

  const fixed_heap& heap() const noexcept { return heap_; }

  // Until its end, what libwebsockets allocates in this thread comes from `from`.
  class [[nodiscard]] lending {
   public:
    explicit lending(lws_memory& from) noexcept;
    ~lending();
    lending(const lending&) = delete;
    lending& operator=(const lending&) = delete;

   private:
    fixed_heap* before_;
  };

  // The allocator for lws_set_allocator(): as realloc(), but it frees if `bytes` is 0.
  static void* allocate(void* held, std::size_t bytes, const char* reason) noexcept;

 private:
  rt::arena region_;
  fixed_heap heap_;
};

} // namespace rowe::net
