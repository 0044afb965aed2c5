// SPDX-License-Identifier: Apache-2.0
// What is asked of the kernel for a connection, read back from a socket of the test's own.
#include <linux/socket.h>
#include <netinet/tcp.h>

#include "net/base/socket_options.hpp"
#include "support.hpp"

namespace rowe::net {
namespace options_test {
namespace {

struct prepared : testing::Test {
  descriptor socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};

  int read(int level, int option) const {
    int value = -1;
    socklen_t bytes = sizeof value;
    EXPECT_EQ(::getsockopt(socket.get(), level, option, &value, &bytes), 0);
    return value;
  }
  // {seconds of silence, between questions, questions, milliseconds of unacknowledged data}
  std::vector<int> vanishing(rt::duration after) {
    socket.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    prepare_for_frames(socket.get(), {.vanished_after = after});
    EXPECT_EQ(read(SOL_SOCKET, SO_KEEPALIVE), 1);
    return {read(IPPROTO_TCP, TCP_KEEPIDLE), read(IPPROTO_TCP, TCP_KEEPINTVL), read(IPPROTO_TCP, TCP_KEEPCNT),
            read(IPPROTO_TCP, TCP_USER_TIMEOUT)};
  }
};

TEST_F(prepared, sends_at_once_and_holds_back_what_is_not_sent) {
  prepare_for_frames(socket.get(), {.unsent_bytes_max = 12345});
  EXPECT_NE(read(IPPROTO_TCP, TCP_NODELAY), 0);
  EXPECT_EQ(read(IPPROTO_TCP, TCP_NOTSENT_LOWAT), 12345);
}

TEST_F(prepared, repeats_what_is_lost_soon_where_the_kernel_lets_one_choose) {
  constexpr int tcp_rto_min_us = 45;
  int value = 0;
  socklen_t bytes = sizeof value;
  if (::getsockopt(socket.get(), IPPROTO_TCP, tcp_rto_min_us, &value, &bytes) != 0)
    GTEST_SKIP() << "no TCP_RTO_MIN_US: Linux has it since 6.15";
  prepare_for_frames(socket.get(), {});
  EXPECT_EQ(read(IPPROTO_TCP, tcp_rto_min_us), 20'000);
}

TEST_F(prepared, limits_the_send_buffer_and_lets_it_grow_again) {
  limit_send_buffer(socket.get(), 16384);
  EXPECT_EQ(read(SOL_SOCKET, SO_SNDBUF), 2 * 16384); // the kernel's own doubling
  int locks = 0;
  socklen_t bytes = sizeof locks;
  if (::getsockopt(socket.get(), SOL_SOCKET, SO_BUF_LOCK, &locks, &bytes) != 0)
    GTEST_SKIP() << "this kernel is older than 5.14 and keeps a limit once it is set";
  EXPECT_EQ(locks, SOCK_SNDBUF_LOCK);
  limit_send_buffer(socket.get(), 0);
  EXPECT_EQ(read(SOL_SOCKET, SO_BUF_LOCK), 0);
}

TEST_F(prepared, leaves_vanished_peers_to_pings_unless_told) {
  prepare_for_frames(socket.get(), {});
  EXPECT_EQ(read(SOL_SOCKET, SO_KEEPALIVE), 0);
  EXPECT_EQ(read(IPPROTO_TCP, TCP_USER_TIMEOUT), 0);
  prepare_for_frames(socket.get(), {.vanished_after = -1s});
  EXPECT_EQ(read(SOL_SOCKET, SO_KEEPALIVE), 0);
}

TEST_F(prepared, asks_for_vanished_peers_within_the_time_given) {
  EXPECT_EQ(vanishing(8s), (std::vector{4, 1, 4, 8000}));
  EXPECT_EQ(vanishing(60s), (std::vector{32, 7, 4, 60000}));
  EXPECT_EQ(vanishing(7001ms), (std::vector{4, 1, 4, 8000}));
}

TEST_F(prepared, keeps_to_what_the_kernel_can_do) {
  EXPECT_EQ(vanishing(1ns), (std::vector{1, 1, 4, 5000}));
  EXPECT_EQ(vanishing(rt::for_ever), (std::vector{32767 - 4 * 4095, 4095, 4, 32767000}));
}

} // namespace
} // namespace options_test
} // namespace rowe::net
