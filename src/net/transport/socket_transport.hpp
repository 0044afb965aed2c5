// SPDX-License-Identifier: Apache-2.0
// The transport over TCP. It owns an epoll, a listening socket and every established connection.
// libwebsockets serves pages, answers upgrades as server and makes them as client; after the upgrade it no
// longer has the socket (docs/decisions/0001-use-libwebsockets-for-the-handshake-only.md). Made at set-up on
// any thread, used from then on by the service thread alone, except wake().
//
// What a turn costs: poll() is one epoll_wait, and one recv for each readable connection, whatever the number
// of idle ones. A turn after a wait() takes the events which that wait found. After a connection is open,
// nothing here allocates for it.
//
// Process-wide effects, all at set-up: libwebsockets' log is silenced (its level is global); SIGPIPE's
// disposition is saved and restored around the creation of its context, so no other thread should change it
// meanwhile. The limit of open files is left alone: libwebsockets' tables are sized by `handshakes_max`, not
// by that limit. Needed are connections_max + 2 × handshakes_max + 10 descriptors; under TLS, two for each
// handshake and 5 more. And 6 (11 under TLS) are kept for who comes to stop when there is no other.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/tls.hpp>

#include "service/base/transport.hpp"

namespace rowe::net {

// How many of so many places are kept for peers on service::stop_path: the last two, never more than half.
constexpr std::uint32_t kept_for_stop(std::uint32_t places) noexcept { return places < 4 ? places / 2 : 2; }

struct socket_limits {
  // Established connections, 1 to 65536; an upgrade beyond them is answered 503, pages are served all the
  // same. The last ones are kept_for_stop().
  std::uint32_t connections_max = 64;
  // Connections and handshakes from one source (same_source()) that is not loopback; beyond them 503. At
  // least 1. On service::stop_path there is one connection more, and two handshakes.
  std::uint32_t connections_per_address_max = 8;
  // Sockets that become a connection, get a page or are being refused, 1 to 1024. If all are taken, the
  // oldest whose request is not complete is evicted. Pages may have all but kept_for_stop(); beyond them 503.
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

class socket_transport : public service::transport {
 public:
  // Binds, checks with getsockname that what was asked is what was bound, and listens. Set-up: allocates,
  // enters the kernel, does not wait. Errors:
  //   not_loopback    the address is not loopback and `insecure` is not set
  //   address_in_use  value: the port
  //   bad_address     value: errno; EINVAL for a text that is not a numeric address
  //   bad_argument    a limit out of its range; value: what was given, limit: the bound it broke
  //   bad_certificate a file that `tls` names is wrong; check_tls() says how
  //   no_memory       value: the bytes that could not be had, 0 where unknown
  static result<std::unique_ptr<socket_transport>> listen(const listen_options& options) noexcept;

  // Only prepares. transport::connect() begins an attempt, which tries each address of the name in turn. Each
  // attempt resolves the name anew, on a helper thread of its own unless it is numeric. Errors: bad_argument
  // and no_memory as above; bad_url (host empty or with bytes that do not belong there, path without "/" or
  // with blanks); too_big (host, path; value and limit in bytes); no_thread (value: errno).
  static result<std::unique_ptr<socket_transport>> connect(const connect_options& options) noexcept;
  using service::transport::connect;

  // The port we listen on; 0 for a client. Any thread, never waits.
  virtual std::uint16_t port() const noexcept = 0;

  virtual const socket_counters& counters() const noexcept = 0;
};

} // namespace rowe::net
