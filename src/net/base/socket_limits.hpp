// SPDX-License-Identifier: Apache-2.0
// The limits of a transport, and what follows from them. Set-up.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/transport.hpp"

namespace rowe::net {

// How many of so many places are reserved for peers on service::stop_path: the last two, never more than
// half.
constexpr std::uint32_t reserved_for_stop(std::uint32_t places) noexcept {
  return places < 4 ? places / 2 : 2;
}

// The least that libwebsockets can be given: for its context and one handshake.
inline constexpr std::size_t handshake_bytes_least = std::size_t{1} << 16;

struct socket_limits {
  // Established connections, 1 to 65536; an upgrade beyond them is answered 503, pages are served all the
  // same. The last ones are reserved_for_stop().
  std::uint32_t connections_max = 64;
  // Connections and handshakes from one source (same_source()) that is not loopback; beyond them 503. At
  // least 1. On service::stop_path there is one connection more, and two handshakes.
  std::uint32_t connections_per_address_max = 8;
  // Sockets that become a connection, get a page or are being refused, 1 to 1024. If all are taken, the
  // oldest whose request is not complete is evicted. Pages may have all but reserved_for_stop(); beyond them
  // 503.
  std::uint32_t handshakes_max = 32;
  // All memory libwebsockets gets: some 12 KiB for itself, up to 24 KiB for the handshake that is being
  // answered, and copies of what slow readers have not taken of a page. Beyond it 503. 64 KiB to 64 MiB.
  std::size_t handshake_bytes = std::size_t{96} << 10;
  // The whole header of a request (server) or of the answer to ours (client). 256 to 4096.
  std::uint32_t header_bytes_max = 4096;
  // What one connection may deliver in a turn while others are readable too: 512 to 65536. It is small
  // because a stop waits behind one quantum of each other connection.
  std::uint32_t read_quantum_bytes = service::transport_sink::read_bytes_in_turn;
  // And while it is alone: at least, not below the quantum, and at most, up to 1 MiB (read_pace.hpp).
  std::uint32_t read_alone_bytes_min = service::transport_sink::read_bytes_alone_min;
  std::uint32_t read_alone_bytes_max = service::transport_sink::read_bytes_alone_max;
  // SO_SNDBUF, which the kernel doubles; 0 leaves the kernel's. For links with a round trip below 2 ms only:
  // elsewhere a small buffer caps the rate.
  std::uint32_t send_buffer_bytes = 0;
  // TCP_NOTSENT_LOWAT: what the kernel may hold without having sent it.
  std::uint32_t unsent_bytes_max = 16384;

  rt::duration header_timeout = std::chrono::seconds{5};  // accepted until the request's header is whole
  rt::duration page_timeout = std::chrono::seconds{10};   // each 64 KiB of a page
  rt::duration connect_timeout = std::chrono::seconds{5}; // client: one attempt, resolving the name included
  rt::duration write_timeout = std::chrono::seconds{1};   // a write refused, and nothing acknowledged since
  rt::duration close_timeout = service::close_time_max;   // waiting for the peer's end of a flushed close
  // For peers that must not be pinged. Our kernel asks the peer's kernel now and then (TCP keep-alive). After
  // about so long without any answer, the connection ends: timed_out, or reset if the network reports one. In
  // whole seconds, rounded up, 5 at least and 32767 at most. 0 or less: never.
  rt::duration vanished_after = rt::duration::zero();
};

// Whether each is in its range; else bad_argument with what was given, and the bound it broke.
status check(const socket_limits& limits) noexcept;

// How many descriptors a server reserves: for one peer that is accepted, and for a duplicate; for peers that
// come to stop, under TLS each with a pair; and for those that have come.
std::size_t descriptors_reserved(const socket_limits& limits, bool tls) noexcept;

} // namespace rowe::net
