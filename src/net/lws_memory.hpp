// SPDX-License-Identifier: Apache-2.0
// The memory that libwebsockets allocates from: one heap of a fixed size for each of our contexts, mapped,
// present and locked when the context is made.
//
// libwebsockets has one allocator for the whole process, which is told neither the context nor the thread. So
// ours looks at what the calling thread has been lent: whoever calls libwebsockets for a context of ours
// lends the thread its heap for as long as the call takes (`lws_memory::lending`). A context is made on one
// thread and used on another, but never by two at once; so its heap needs no lock, and all that was taken
// from it is given back to it. Every other call, such as those of a program that uses libwebsockets itself,
// goes to the C library as it would without us.
#pragma once
#include <cstddef>

#include <rowe/rt/arena.hpp>

#include "net/fixed_heap.hpp"

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

  // What lws_set_allocator() is given: realloc() that frees where `bytes` is 0.
  static void* allocate(void* held, std::size_t bytes, const char* reason) noexcept;

 private:
  rt::arena region_;
  fixed_heap heap_;
};

} // namespace rowe::net
