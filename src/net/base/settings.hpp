// SPDX-License-Identifier: Apache-2.0
// What a transport gets at set-up, and what it counts: all folders of src/net read these.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/tls.hpp>

#include "net/base/socket_limits.hpp"

namespace rowe::net {

struct listen_options {
  std::string_view address = "127.0.0.1"; // numeric, IPv4 or IPv6; an IPv6 address never takes IPv4 as well
  std::uint16_t port = 0;                 // 0: any free one, see port()
  // Allows addresses beyond loopback: everybody who reaches them may speak, or is asked who that is.
  bool insecure = false;
  // Origins besides our own from which pages may connect, as browsers write them: "http://lab.example:8000".
  std::span<const std::string_view> allow_origins{};
  // Names under which we are reached besides localhost, 127.0.0.1 and [::1]. With `insecure` or TLS the
  // host's name and the addresses it has at that moment are added. "*" allows every name, and with it DNS
  // rebinding.
  std::span<const std::string_view> allow_hosts{};
  // The WebSocket subprotocols we speak. None offered: none chosen; offered and none known: refused.
  std::span<const std::string_view> subprotocols{};
  // For Hop's clients: see wire::handshake_policy::lenient.
  bool lenient_handshake = false;
  // With a certificate: the port speaks TLS alone.
  tls_options tls{};
  socket_limits limits{};
};

struct connect_options {
  std::string_view host; // a name or a numeric address, IPv6 without brackets; ≤ 100 bytes
  std::uint16_t port = 80;
  std::string_view path = "/"; // with its query; begins with "/"; ≤ 1024 bytes
  // Offered in this order. A server that answers without one is accepted, and the connection has none.
  std::span<const std::string_view> subprotocols{};
  std::string_view token{}; // goes with the request (RFC 6750, 2.1); empty: none
  bool secure = false;      // TLS; with `tls`
  tls_options tls{};
  socket_limits limits{};
};

// How often the costly parts ran, for tests and `stats`. Service thread.
struct socket_counters {
  std::uint64_t polls = 0;              // poll() calls
  std::uint64_t waits = 0;              // wait() calls that entered the kernel
  std::uint64_t lws_turns = 0;          // calls of lws_service()
  std::uint64_t accepted = 0;           // sockets taken from the listener
  std::uint64_t opened = 0;             // connections reported by on_open
  std::uint64_t accept_pauses = 0;      // the process ran out of descriptors or memory
  std::uint64_t handshakes_cut = 0;     // refused on the spot because no place was left, nor to be had
  std::uint64_t handshakes_evicted = 0; // ended before their request was whole: a newer one needed the place
  std::uint64_t pages_cut = 0;          // whose body was long, and was not sent to its end
  std::uint64_t handshakes_slowed = 0;  // wrong tokens that are answered late
  std::uint64_t handshakes_starved = 0; // refused because `handshake_bytes` were used up
};

} // namespace rowe::net
