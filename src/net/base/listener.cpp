// SPDX-License-Identifier: Apache-2.0
#include "net/base/listener.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace rowe::net {

namespace {

constexpr int backlog = 128;

error address_error(int code, std::uint16_t port) noexcept {
  if (code == EADDRINUSE) return {errc::address_in_use, port};
  return {errc::bad_address, code};
}

void switch_on(int fd, int level, int option) noexcept {
  const int one = 1;
  (void)::setsockopt(fd, level, option, &one, sizeof one); // both options exist wherever such sockets do
}

} // namespace

listener::listener(descriptor socket, const socket_address& address) noexcept
    : socket_{std::move(socket)}, address_{address} {}

result<listener> listener::open(const listen_options& options) noexcept {
  const auto wanted = numeric_address(options.address, options.port);
  if (!wanted) return error{errc::bad_address, EINVAL};
  if (!options.insecure && !is_loopback(*wanted)) return errc::not_loopback;

  const int family = wanted->storage.ss_family;
  descriptor socket{::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
  if (!socket) return address_error(errno, options.port);
  switch_on(socket.get(), SOL_SOCKET,
            SO_REUSEADDR); // connections of a former run may still linger in TIME_WAIT
  if (family == AF_INET6) switch_on(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY);
  if (::bind(socket.get(), wanted->get(), wanted->bytes) != 0) return address_error(errno, options.port);

  // Checks that what was bound is what was asked for; else we do not start.
  socket_address bound;
  bound.bytes = sizeof bound.storage;
  if (::getsockname(socket.get(), bound.get(), &bound.bytes) != 0) return address_error(errno, options.port);
  const bool right_port = options.port == 0 ? port_of(bound) != 0 : port_of(bound) == options.port;
  if (!same_host(bound, *wanted) || !right_port) return error{errc::bad_address, EADDRNOTAVAIL};
  if (!options.insecure && !is_loopback(bound)) return errc::not_loopback;

  // Two sockets may bind one port while neither listens, so the port may still turn out to be in use.
  if (::listen(socket.get(), backlog) != 0) return address_error(errno, options.port);
  return listener{std::move(socket), bound};
}

bool listener::join(poll_set& polled) noexcept {
  return polled.add(socket_.get(), EPOLLIN, {source::listener});
}

std::optional<accepted_socket> listener::accept(poll_set& polled, reserved_descriptors& kept,
                                                rt::time_point now) noexcept {
  if (paused()) return std::nullopt;
  kept.take_back(); // before this takes it
  accepted_socket next;
  const auto take = [&] {
    next.peer.bytes = sizeof next.peer.storage;
    next.socket.reset(
        ::accept4(socket_.get(), next.peer.get(), &next.peer.bytes, SOCK_NONBLOCK | SOCK_CLOEXEC));
    return static_cast<bool>(next.socket);
  };
  if (take()) return next;
  if (has_no_descriptor(errno) && kept.give()) {
    next.lent = true;
    if (take()) return next;
  }
  if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
    polled.modify(socket_.get(), 0, {source::listener});
    resume_ = rt::deadline_after(now, pause);
  }
  return std::nullopt; // nobody waits, or one who waited is gone again
}

void listener::resume(poll_set& polled, rt::time_point now) noexcept {
  if (now < resume_) return;
  resume_ = rt::never;
  polled.modify(socket_.get(), EPOLLIN, {source::listener});
}

} // namespace rowe::net
