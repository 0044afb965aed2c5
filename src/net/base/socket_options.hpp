// SPDX-License-Identifier: Apache-2.0
// What a TCP socket is asked besides reading and writing. Each is one system call or two that do not wait. A
// failure on a socket that is gone is ignored; the next read or write reports it.
#pragma once
#include <cerrno>
#include <cstdint>

#include <sys/types.h>

#include "net/base/socket_limits.hpp"

namespace rowe::net {

// Whether the errno of a read or write means that it may succeed later.
inline bool would_block(int code) noexcept { return code == EAGAIN || code == EWOULDBLOCK || code == EINTR; }
// The same for a write, which the kernel also refuses for want of memory for its buffers.
inline bool has_no_room(int code) noexcept { return would_block(code) || code == ENOBUFS || code == ENOMEM; }

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

// Whether both directions are closed: nothing that is written arrives any more.
bool has_gone(int fd) noexcept;

// close() will send a reset and drop what is unsent.
void reset_on_close(int fd) noexcept;

// Discards some of what has arrived, without copying it. Returns as recv() does.
ssize_t discard_input(int fd) noexcept;

} // namespace rowe::net
