// SPDX-License-Identifier: Apache-2.0
// What an endpoint's memory is for: an arena, which is locked at once; another for the queue pairs of
// handles, which is locked handle by handle; the transport's share; and the chunks of long messages. Every
// line names its holder. limits::footprint_bytes() is the sum of all but the chunks.
#pragma once
#include <cstddef>

#include <rowe/limits.hpp>

namespace rowe::service {

struct memory_plan {
  std::size_t core;        // the core's tables and buffers, and the core itself
  std::size_t shared;      // what it publishes to other threads
  std::size_t threads;     // the submission queue and the shared inbox
  std::size_t waker;       // with which handles wake the service thread
  std::size_t pairs;       // the queue pairs' shared words
  std::size_t pair_memory; // their rings, windows and slots
  std::size_t handshakes;  // for those under way; the transport takes it
  std::size_t tls;         // of the heap, as peers come; nothing without TLS

  std::size_t chunks; // of the heap, for long messages: not locked, and touched only as it is used

  std::size_t arena() const noexcept { return core + shared + threads + waker + pairs; }
  std::size_t total() const noexcept { return arena() + pair_memory + handshakes + tls; }
};

memory_plan plan_memory(const limits& bounds, transport_security with = transport_security::none) noexcept;

} // namespace rowe::service
