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
// handshake and 5 more. And 6 (11 under TLS) are reserved for the stop, for when there is no other.
#pragma once
#include <cstdint>
#include <memory>

#include <rowe/result.hpp>

#include "net/base/settings.hpp"
#include "service/base/transport.hpp"

namespace rowe::net {

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
