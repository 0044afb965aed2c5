// SPDX-License-Identifier: Apache-2.0
// Into how many segments the kernel cuts what is written, read from the receiver's socket.
#include <linux/tcp.h>

#include "support.hpp"

namespace rowe::net {
namespace segments_test {
namespace {

struct segments : served {
  raw_socket client = upgraded(drive, *transport);
  connection_id id = drive.sink().opens[0].id;

  unsigned arrived() const {
    tcp_info info{};
    socklen_t bytes = sizeof info;
    EXPECT_EQ(::getsockopt(client.fd(), IPPROTO_TCP, TCP_INFO, &info, &bytes), 0);
    return info.tcpi_data_segs_in;
  }
  // Writes all of it from there on, the client reading.
  void send(std::string_view whole, std::size_t taken = 0) {
    const auto go_on = [&] {
      if (taken < whole.size()) taken += write(*transport, id, whole.substr(taken));
      return client.read() && client.text.size() >= whole.size();
    };
    ASSERT_TRUE(drive.until(go_on));
    EXPECT_EQ(client.text, whole);
  }
};

// A receiver acknowledges a lone segment late, and the buffer takes no other until then: see established.cpp.
TEST_F(segments, are_at_least_two_for_what_fills_the_send_buffer_of_a_low_rtt_peer) {
  transport->limit_send_buffer(id, 16384);
  const unsigned before = arrived();
  std::string large(60'000, 'x');
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<char>('a' + i / 100 % 26);
  send(large);
  EXPECT_GE(arrived() - before, 4U);
}

// Of a frame that was begun; and then no more until that is read.
TEST_F(segments, go_into_the_kernel_where_they_are_the_rest_of_what_was_begun) {
  transport->limit_send_buffer(id, 16384);
  const std::string large(200'000, 'x');
  const std::size_t taken = write(*transport, id, large);
  ASSERT_LT(taken, large.size());
  EXPECT_EQ(write(*transport, id, "y"), 0U);
  const auto rest = std::as_bytes(std::span{large}).subspan(taken, 60'000);
  EXPECT_EQ(transport->write_rest(id, rest), rest.size());
  EXPECT_EQ(write(*transport, id, "y"), 0U);
  send(large, taken + rest.size());
}

} // namespace
} // namespace segments_test
} // namespace rowe::net
