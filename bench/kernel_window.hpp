// SPDX-License-Identifier: Apache-2.0
// What the kernel holds of a connection over loopback: written by the one program, and not taken by the
// other.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"

namespace rowe::bench {

// What was sent over loopback has arrived, so it is what waits to be sent at our end and what waits to be
// read at the peer's. 0 where the kernel does not say.
class kernel_window {
 public:
  std::size_t bytes_between(int our_end) const {
    sockaddr_in ours{}, theirs{};
    socklen_t bytes = sizeof ours;
    int unsent = 0;
    if (::getsockname(our_end, reinterpret_cast<sockaddr*>(&ours), &bytes) != 0 ||
        ::getpeername(our_end, reinterpret_cast<sockaddr*>(&theirs), &bytes) != 0 ||
        ::ioctl(our_end, SIOCOUTQNSD, &unsent) != 0)
      return 0;
    return static_cast<std::size_t>(unsent) + unread(theirs, ours);
  }

  // The end of a connection to this port that this process has, whoever opened it; -1 if there is none.
  static int end_at(std::uint16_t port) {
    for (int fd = 0; fd < 64; ++fd) {
      sockaddr_in ours{}, theirs{};
      socklen_t bytes = sizeof ours;
      if (::getsockname(fd, reinterpret_cast<sockaddr*>(&ours), &bytes) == 0 &&
          ours.sin_port == htons(port) &&
          ::getpeername(fd, reinterpret_cast<sockaddr*>(&theirs), &bytes) == 0)
        return fd;
    }
    return -1;
  }

 private:
  std::size_t unread(const sockaddr_in& at, const sockaddr_in& from) const {
    struct {
      nlmsghdr header;
      inet_diag_req_v2 of;
    } question{};
    question.header = {.nlmsg_len = sizeof question,
                       .nlmsg_type = SOCK_DIAG_BY_FAMILY,
                       .nlmsg_flags = NLM_F_REQUEST,
                       .nlmsg_seq = 0,
                       .nlmsg_pid = 0};
    question.of.sdiag_family = AF_INET;
    question.of.sdiag_protocol = IPPROTO_TCP;
    question.of.idiag_states = ~0U;
    question.of.id.idiag_sport = at.sin_port;
    question.of.id.idiag_dport = from.sin_port;
    question.of.id.idiag_src[0] = at.sin_addr.s_addr;
    question.of.id.idiag_dst[0] = from.sin_addr.s_addr;
    question.of.id.idiag_cookie[0] = question.of.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
    struct {
      nlmsghdr header;
      inet_diag_msg said;
      std::array<std::byte, 512> rest;
    } answer{};
    if (::send(socket_.get(), &question, sizeof question, 0) < 0 ||
        ::recv(socket_.get(), &answer, sizeof answer, 0) < 0 ||
        answer.header.nlmsg_type != SOCK_DIAG_BY_FAMILY)
      return 0;
    return answer.said.idiag_rqueue;
  }

  net::descriptor socket_{::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG)};
};

} // namespace rowe::bench
