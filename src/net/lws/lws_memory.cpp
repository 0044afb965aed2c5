// SPDX-License-Identifier: Apache-2.0
#include "net/lws/lws_memory.hpp"

#include <libwebsockets.h>

#include <cstdlib>
#include <utility>

namespace rowe::net {

namespace {

constinit thread_local fixed_heap* lent = nullptr;

} // namespace

lws_memory::lws_memory(std::size_t bytes) noexcept : region_{bytes, rt::page_lock::attempted} {
  if (!region_) return;
  heap_ = fixed_heap{region_.carve_bytes(region_.bytes_total())};
  static const bool installed = (::lws_set_allocator(&lws_memory::allocate), true);
  (void)installed; // it is the first use that counts
}

lws_memory::lending::lending(lws_memory& from) noexcept : before_{std::exchange(lent, &from.heap_)} {}
lws_memory::lending::~lending() { lent = before_; }

void* lws_memory::allocate(void* held, std::size_t bytes, const char*) noexcept {
  const bool ours = lent != nullptr && (held == nullptr || lent->owns(held));
  if (bytes == 0) {
    if (ours)
      lent->give(held);
    else
      std::free(held); // NOLINT(cppcoreguidelines-no-malloc): as libwebsockets does by itself
    return nullptr;
  }
  return ours ? lent->resize(held, bytes) : std::realloc(held, bytes);
}

} // namespace rowe::net
