// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "wire/rosbridge/rosbridge.hpp"
#include "wire/written.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_encode_test {
namespace {

class rosbridge_encode : public testing::Test {
 protected:
  std::array<char, 2048> buffer_{};
};

TEST_F(rosbridge_encode, needs_no_more_for_a_publish_head_than_it_says) {
  for (const std::size_t length : {0U, 1U, 128U}) {
    const std::string worst(length, '"');
    std::vector<char> exact(publish_head_bytes_max(length));
    EXPECT_FALSE(written(exact, write_publish_head, worst).empty()) << length;
  }
}

TEST_F(rosbridge_encode, writes_subscribe_and_unsubscribe_with_one_id) {
  EXPECT_EQ(written(buffer_, write_subscribe, "/odom", "nav_msgs/Odometry", 0),
            R"({"op":"subscribe","id":"subscribe:/odom:1","type":"nav_msgs/Odometry","topic":"/odom",)"
            R"("compression":"none","throttle_rate":0,"queue_length":0})");
  EXPECT_EQ(
      written(buffer_, write_subscribe, "/odom", "", 0),
      R"({"op":"subscribe","id":"subscribe:/odom:1","topic":"/odom","compression":"none","throttle_rate":0,)"
      R"("queue_length":0})");
  EXPECT_EQ(written(buffer_, write_unsubscribe, "/odom"),
            R"({"op":"unsubscribe","id":"subscribe:/odom:1","topic":"/odom"})");
}

TEST_F(rosbridge_encode, writes_advertise_and_unadvertise_with_one_id) {
  EXPECT_EQ(
      written(buffer_, write_advertise, "/cmd", "geometry_msgs/Twist", true),
      R"({"op":"advertise","id":"advertise:/cmd:1","type":"geometry_msgs/Twist","topic":"/cmd","latch":true,)"
      R"("queue_size":100})");
  EXPECT_EQ(written(buffer_, write_advertise, "/cmd", "", false),
            R"({"op":"advertise","id":"advertise:/cmd:1","topic":"/cmd","latch":false,"queue_size":100})");
  EXPECT_EQ(written(buffer_, write_unadvertise, "/cmd"),
            R"({"op":"unadvertise","id":"advertise:/cmd:1","topic":"/cmd"})");
}

TEST_F(rosbridge_encode, writes_nothing_where_it_does_not_fit) {
  for (std::size_t bytes = 0; bytes < 40; ++bytes) {
    const std::span<char> small = std::span{buffer_}.first(bytes);
    EXPECT_TRUE(written(small, write_status, severity::error, "1", "too long for the room").empty());
    EXPECT_TRUE(written(small, write_subscribe, "/t", "", 0).empty());
    EXPECT_TRUE(written(small, write_unsubscribe, "/t").empty());
    EXPECT_TRUE(written(small, write_advertise, "/t", "", false).empty());
    EXPECT_TRUE(written(small, write_unadvertise, "/t").empty());
    EXPECT_TRUE(written(small, write_publish_head, "a longer topic").empty());
  }
  std::vector<char> plenty(20'000);
  EXPECT_TRUE(written(plenty, write_subscribe, std::string(1100, 't'), "", 0).empty());
}

TEST_F(rosbridge_encode, needs_no_more_for_requests_than_it_says) {
  const name_limits limits{.name_bytes_max = 128, .id_bytes_max = 256};
  const std::string worst(limits.name_bytes_max, '\x01');
  std::vector<char> exact(request_bytes_max(limits));
  EXPECT_FALSE(written(exact, write_subscribe, worst, worst, 3'600'000).empty());
  EXPECT_FALSE(written(exact, write_advertise, worst, worst, false).empty());
  EXPECT_FALSE(written(exact, write_unsubscribe, worst).empty());
  EXPECT_FALSE(written(exact, write_unadvertise, worst).empty());
  EXPECT_FALSE(written(exact, write_advertise_service, worst, worst).empty());
  EXPECT_FALSE(written(exact, write_unadvertise_service, worst).empty());
}

} // namespace
} // namespace rosbridge_encode_test
} // namespace rowe::wire::rosbridge
