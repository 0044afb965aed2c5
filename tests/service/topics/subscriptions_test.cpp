// SPDX-License-Identifier: Apache-2.0
#include "service/topics/subscriptions.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/topics/topic_parts.hpp"

namespace subscriptions_test {
namespace {

using namespace topic_parts;

struct subscriptions_test : topic_parts::topic_parts {
  connection& peer = join(0);

  rowe::service::subscription& only(std::string_view topic) {
    return subscriptions.at(subscriptions.find(topics.find(topic), {peer.id.index}));
  }
};

TEST_F(subscriptions_test, have_four_requests_at_most) {
  for (const char* id : {"1", "2", "3", "4"}) subscribe(peer, "/odom", id);
  EXPECT_TRUE(told(peer).empty());
  subscribe(peer, "/odom", "5");
  EXPECT_TRUE(was_told(peer, "one peer may hold 4 subscriptions to a topic"));
  EXPECT_EQ(only("/odom").request_count, 4);
}

TEST_F(subscriptions_test, that_are_not_there_cannot_end) {
  unsubscribe(peer, "/odom");
  EXPECT_TRUE(was_told(peer, "there is no such subscription"));
  subscribe(peer, "/odom", "1");
  unsubscribe(peer, "/odom", "2");
  EXPECT_TRUE(was_told(peer, "there is no subscription with this id"));
  EXPECT_TRUE(subscribed(peer, "/odom"));
}

TEST_F(subscriptions_test, of_one_peer_leave_each_other_one_its_claim) {
  for (int i = 0; i < 32; ++i) (void)hold_as_own("/t" + std::to_string(i)); // which so cost a peer no topic
  for (int i = 0; i < 32; ++i) subscribe(peer, "/t" + std::to_string(i));
  EXPECT_TRUE(was_told(peer, "subscriptions_max"));
  EXPECT_GT(subscriptions.count(), 4U) << "what nobody claims is for who comes first";
  for (std::uint32_t other = 1; other < bounds.connections_max; ++other) {
    connection& late = join(other);
    for (int i = 0; i < 4; ++i) subscribe(late, "/t" + std::to_string(i));
    EXPECT_EQ(subscriptions.count_of({other}), 4U) << "a half of 32, by four connections";
  }
}

TEST_F(subscriptions_test, learn_the_type_when_the_topic_gets_another_one) {
  request asked = of(peer, "/odom");
  asked.type = "std_msgs/String";
  readers.subscribe(peer, asked);
  EXPECT_TRUE(told(peer).empty()) << "the topic has no type yet";
  connection& writer = join(1);
  advertise(writer, "/odom", "nav_msgs/Odometry");
  EXPECT_TRUE(was_told(peer, "the topic has the type nav_msgs/Odometry"));
}

} // namespace
} // namespace subscriptions_test
