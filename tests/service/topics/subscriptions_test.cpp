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
