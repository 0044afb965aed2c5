// SPDX-License-Identifier: Apache-2.0
// What a TCP socket is asked besides reading and writing. Each is one system call or two that do not wait. A
// failure on a socket that is gone is ignored; the next read or write reports it.
#pragma once
#include <cstdint>

#include <sys/types.h>

#include "net/socket_transport.hpp"

namespace rowe::net {

// TCP_NODELAY, which libwebsockets does not set on sockets it is handed.
void send_at_once(int fd) noexcept;

// The above, TCP_RTO_MIN_US where the kernel has it, TCP_NOTSENT_LOWAT, SO_SNDBUF and, for `vanished_after`,
// SO_KEEPALIVE, as `limits` say.
void prepare_for_frames(int fd, const socket_limits& limits) noexcept;

// Makes room for so many bytes more than the buffer has, sent or not, until the limits are set again.
void widen_send_buffer(int fd, std::size_t bytes) noexcept;

// TCP_NOTSENT_LOWAT.
void limit_unsent(int fd, std::uint32_t bytes) noexcept;

// SO_SNDBUF; 0: the kernel chooses from now on, if it allows that (Linux 5.14).
void limit_send_buffer(int fd, std::uint32_t bytes) noexcept;

// Bytes the peer has not acknowledged, sent or not (SIOCOUTQ).
int unacknowledged_bytes(int fd) noexcept;

// The pending error (SO_ERROR). Reading it clears it.
int socket_error(int fd) noexcept;

// close() will send a reset and drop what is unsent.
void reset_on_close(int fd) noexcept;

// Discards some of what has arrived, without copying it. Returns as recv() does.
ssize_t discard_input(int fd) noexcept;

} // namespace rowe::net
