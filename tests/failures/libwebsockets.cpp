// SPDX-License-Identifier: Apache-2.0
#include "failures/injection.hpp"

#include <libwebsockets.h>

#include "net/lws/lws_memory.hpp"

namespace failures {
namespace {

void* allocate(void* held, std::size_t bytes, const char* reason) noexcept {
  if (bytes != 0 && fails(kind::libwebsockets, reason)) return nullptr;
  return rowe::net::lws_memory::allocate(held, bytes, reason);
}

} // namespace

void watch_libwebsockets() noexcept {
  const rowe::net::lws_memory first{1 << 16}; // which sets the library's own allocator
  ::lws_set_allocator(&allocate);
}

} // namespace failures
