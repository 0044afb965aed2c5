// SPDX-License-Identifier: Apache-2.0
// The listening socket. It is ours and not libwebsockets', because version 4.1.6 binds every address when
// asked for 127.0.0.1 (its issue 2290). Opened at set-up, used by the service thread.
#pragma once
#include <optional>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "net/base/address.hpp"
#include "net/base/arrival.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/reserved_descriptors.hpp"
#include "net/base/settings.hpp"

namespace rowe::net {

struct accepted_socket {
  descriptor socket; // non-blocking, close-on-exec
  socket_address peer;
  tls::place_id place{}; // under TLS: where its session is; the socket is local then, and plain
  tls::client_certificate shown{};
  bool lent = false; // a descriptor that is reserved for the stop
};

class listener {
 public:
  // If the process has no descriptor or memory left, the listener pauses for so long.
  static constexpr rt::duration pause = std::chrono::milliseconds{100};

  // Errors: not_loopback, bad_address, address_in_use as in socket_transport::listen().
  static result<listener> open(const listen_options& options) noexcept;

  const socket_address& address() const noexcept { return address_; }

  bool join(poll_set& polled) noexcept;

  // The next connection, if one waits. If the process has no descriptor left, it gets one of `kept`. If there
  // is none, or no memory, nothing; then paused() is true.
  std::optional<accepted_socket> accept(poll_set& polled, reserved_descriptors& kept,
                                        rt::time_point now) noexcept;
  bool paused() const noexcept { return resume_ != rt::never; }

  // Ends the pause when its time has come.
  void resume(poll_set& polled, rt::time_point now) noexcept;
  rt::time_point next_deadline() const noexcept { return resume_; }

 private:
  listener(descriptor socket, const socket_address& address) noexcept;

  descriptor socket_;
  socket_address address_; // what getsockname said
  rt::time_point resume_ = rt::never;
};

} // namespace rowe::net
