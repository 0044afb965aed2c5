// SPDX-License-Identifier: Apache-2.0
// Sockets of a test's own at this machine.
#pragma once
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>

namespace rowe::tests {

// Port 0: any.
inline sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return at;
}
inline bool connect_to(std::uint16_t port, int socket) {
  const sockaddr_in there = loopback(port);
  return ::connect(socket, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0;
}
inline bool listens(int socket, int backlog) {
  const sockaddr_in any = loopback(0);
  return ::bind(socket, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0 &&
         ::listen(socket, backlog) == 0;
}
inline std::uint16_t port_of(int socket) {
  sockaddr_in here{};
  socklen_t bytes = sizeof here;
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&here), &bytes);
  return ntohs(here.sin_port);
}

} // namespace rowe::tests
