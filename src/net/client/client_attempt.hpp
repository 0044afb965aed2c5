// SPDX-License-Identifier: Apache-2.0
// Makes one attempt after another to reach the remote of a client. An attempt looks the name up, connects to
// its addresses in turn, asks for the upgrade, and hands the upgraded socket to the established connections.
// Service thread; libwebsockets allocates during an attempt.
//
// libwebsockets makes the socket and writes the request. We keep a duplicate of the socket from the start,
// and read the answer up to the end of its header. libwebsockets gets that header through a socket pair
// (lws_host::take_answer), because the bytes behind it belong to the connection.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "net/base/arrival.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/settings.hpp"
#include "net/client/resolver.hpp"
#include "net/connections/established.hpp"
#include "net/lws/lws_host.hpp"
#include "service/base/transport.hpp"

namespace rowe::net {

namespace tls {
class terminator;
}

class client_attempt {
 public:
  // Checks the options and starts the resolver's helper where the host is a name. Errors as of
  // socket_transport::connect(). `scratch` as in handshakes.
  static result<std::unique_ptr<client_attempt>> open(const connect_options& options, poll_set& polled,
                                                      lws_host& host, established& connections,
                                                      socket_counters& counters, std::span<std::byte> scratch,
                                                      int waker);
  ~client_attempt();
  client_attempt(const client_attempt&) = delete;
  client_attempt& operator=(const client_attempt&) = delete;

  // Set-up: makes the attempts by TLS.
  void use(tls::terminator& secure) noexcept { terminator_ = &secure; }
  // The TLS handshake is done: what is read and written in plain.
  void on_secured(tls::place_id place, descriptor plain, service::transport_sink& sink) noexcept;
  void on_not_secured(tls::place_id place, const wire::http_rejection& why,
                      service::transport_sink& sink) noexcept;

  // The addresses to try from now on; the name is not looked up any more.
  void use(const resolved_host& addresses) noexcept;

  // An attempt begins in the next step(), unless one is under way or stands.
  void ask() noexcept { asked_ = true; }
  bool asked() const noexcept { return asked_; }
  bool busy() const noexcept { return asked_ || now_ != phase::idle; }

  void on_event(const socket_event& event, rt::time_point now, service::transport_sink& sink) noexcept;
  // Begins an attempt that was asked for, takes the resolver's answer, and ends an attempt that took too
  // long. Called once a turn.
  void step(rt::time_point now, service::transport_sink& sink) noexcept;
  rt::time_point next_deadline() const noexcept;

 private:
  enum class phase : std::uint8_t {
    idle,
    resolving,
    connecting,
    securing, // the TLS handshake is under way
    waiting,
  };

  client_attempt(const connect_options& options, poll_set& polled, lws_host& host, established& connections,
                 socket_counters& counters, std::span<std::byte> scratch);
  void begin(rt::time_point now, service::transport_sink& sink) noexcept;
  void resolve(rt::time_point now, service::transport_sink& sink) noexcept;
  void next_address(rt::time_point now, service::transport_sink& sink) noexcept;
  void secure(service::transport_sink& sink) noexcept;
  void fail_for_descriptors(service::transport_sink& sink) noexcept;
  void on_connected(rt::time_point now, service::transport_sink& sink) noexcept;
  void read_answer(std::uint32_t events, service::transport_sink& sink) noexcept;
  void finish(std::string_view header, service::transport_sink& sink) noexcept;
  void time_out(rt::time_point now, service::transport_sink& sink) noexcept;
  void drop_socket() noexcept;
  void fail(service::transport_sink& sink, std::uint16_t status, std::string_view what,
            std::string_view remedy, bool lasting = false) noexcept;
  void fail_by_error(service::transport_sink& sink, int code) noexcept;

  const socket_limits limits_;
  const std::string host_; // as given
  const std::uint16_t port_;
  const std::string path_;
  std::string authority_;    // host and port, for the Host header and for diagnostics
  std::string subprotocols_; // a list with commas
  std::string authorization_;
  poll_set& polled_;
  lws_host& lws_;
  established& connections_;
  socket_counters& counters_;
  std::span<std::byte> scratch_;
  tls::terminator* terminator_ = nullptr; // under TLS
  std::unique_ptr<resolver> resolver_;    // none where the host is numeric

  bool asked_ = false;
  phase now_ = phase::idle;
  rt::time_point deadline_ = rt::never;         // of the attempt
  rt::time_point address_deadline_ = rt::never; // of the address that is being tried
  resolved_host found_;
  std::size_t next_ = 0; // index into found_
  socket_address peer_;
  descriptor socket_;   // our duplicate; under TLS, once secured, a local one
  tls::place_id place_; // where the terminator has the session, once secured
  lws_watch watch_;
  std::uint32_t generation_ = 0;
  std::uint32_t scanned_ = 0;
};

} // namespace rowe::net
