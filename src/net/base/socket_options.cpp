// SPDX-License-Identifier: Apache-2.0
#include "net/base/socket_options.hpp"

#include <linux/socket.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace rowe::net {

namespace {

constexpr std::size_t discarded_per_call = 16384;

// How soon TCP repeats what was not acknowledged, in addition to the round trip. By default it waits 200 ms
// at least. A segment that is lost twice in a row then holds up everything for a quarter of a second, and one
// that is lost three times for longer than the timeout of a stop's guard.
constexpr int retransmission_us_min = 20'000;
constexpr int tcp_rto_min_us = 45; // TCP_RTO_MIN_US of Linux 6.15, which older headers lack; refused before

void set(int fd, int level, int option, int value) noexcept {
  (void)::setsockopt(fd, level, option, &value, sizeof value); // see the header
}

// The peer may be silent for about half of the time; then it is asked four times. The kernel does not ask
// while sent data is unacknowledged; that has a limit of its own.
void notice_vanishing(int fd, rt::duration after) noexcept {
  if (after <= rt::duration::zero()) return;
  constexpr rt::duration::rep shortest = 5, longest = 32767; // the longer one is the kernel's
  constexpr int probes = 4;
  constexpr auto ceiled = [](rt::duration time) {
    return std::chrono::ceil<std::chrono::seconds>(time).count();
  };
  constexpr rt::duration most = std::chrono::seconds{longest};
  const int seconds = static_cast<int>(std::max(shortest, ceiled(std::min(after, most))));
  const int between = std::max(1, seconds / (2 * probes));
  set(fd, IPPROTO_TCP, TCP_KEEPIDLE, seconds - probes * between);
  set(fd, IPPROTO_TCP, TCP_KEEPINTVL, between);
  set(fd, IPPROTO_TCP, TCP_KEEPCNT, probes);
  set(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, seconds * 1000);
  set(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
}

} // namespace

void send_at_once(int fd) noexcept { set(fd, IPPROTO_TCP, TCP_NODELAY, 1); }

void prepare_for_frames(int fd, const socket_limits& limits) noexcept {
  send_at_once(fd);
  set(fd, IPPROTO_TCP, tcp_rto_min_us, retransmission_us_min);
  limit_unsent(fd, limits.unsent_bytes_max);
  if (limits.send_buffer_bytes) limit_send_buffer(fd, limits.send_buffer_bytes);
  notice_vanishing(fd, limits.vanished_after);
}

void limit_send_buffer(int fd, std::uint32_t bytes) noexcept {
  if (bytes) return set(fd, SOL_SOCKET, SO_SNDBUF, static_cast<int>(bytes));
  int locks = 0;
  socklen_t size = sizeof locks;
  if (::getsockopt(fd, SOL_SOCKET, SO_BUF_LOCK, &locks, &size) == 0)
    set(fd, SOL_SOCKET, SO_BUF_LOCK, locks & ~SOCK_SNDBUF_LOCK);
}

// The kernel doubles the size that it is given, for its own bookkeeping. What is in the buffer may exceed it
// a little.
void widen_send_buffer(int fd, std::size_t bytes) noexcept {
  constexpr std::size_t slack = 64 * 1024;
  constexpr std::size_t most = std::size_t{1} << 28;
  int before = 0;
  socklen_t size = sizeof before;
  if (::getsockopt(fd, SOL_SOCKET, SO_SNDBUF, &before, &size) != 0) return;
  set(fd, SOL_SOCKET, SO_SNDBUF, before / 2 + static_cast<int>(std::min(bytes + slack, most)));
  limit_unsent(fd, UINT32_MAX >> 1);
}

void limit_unsent(int fd, std::uint32_t bytes) noexcept {
  set(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, static_cast<int>(bytes));
}

int unacknowledged_bytes(int fd) noexcept {
  int bytes = 0;
  return ::ioctl(fd, SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

int socket_error(int fd) noexcept {
  int code = 0;
  socklen_t bytes = sizeof code;
  (void)::getsockopt(fd, SOL_SOCKET, SO_ERROR, &code, &bytes); // fails for no socket of ours
  return code;
}

bool has_gone(int fd) noexcept {
  pollfd one{.fd = fd, .events = 0, .revents = 0};
  return ::poll(&one, 1, 0) == 1 && (one.revents & (POLLERR | POLLHUP)) != 0;
}

void reset_on_close(int fd) noexcept {
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  (void)::setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once); // see the header
}

ssize_t discard_input(int fd) noexcept {
  char nothing[discarded_per_call]; // is not written: MSG_TRUNC
  return ::recv(fd, nothing, sizeof nothing, MSG_TRUNC | MSG_DONTWAIT);
}

} // namespace rowe::net
