// SPDX-License-Identifier: Apache-2.0
#include "service/topics/advertisements.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/topics/topic_parts.hpp"

namespace advertisements_test {
namespace {

using namespace topic_parts;

struct advertisements_test : topic_parts::topic_parts {
  connection& peer = join(0);

  void unadvertise(connection& c, std::string_view topic) { writers.unadvertise(c, of(c, topic)); }
  bool advertises(const connection& c, std::string_view topic) {
    const topic_id found = topics.find(topic);
    return found && advertised.find({c.id.index}, found) != nullptr;
  }
};

TEST_F(advertisements_test, hold_their_topic_and_give_it_their_type) {
  advertise(peer, "/odom", "nav_msgs/Odometry");
  ASSERT_TRUE(advertises(peer, "/odom"));
  EXPECT_EQ(topics.type(topics.find("/odom")), "nav_msgs/Odometry");
  unadvertise(peer, "/odom");
  EXPECT_EQ(topics.count(), 0U);
}

TEST_F(advertisements_test, by_another_type_are_refused) {
  connection& second = join(1);
  advertise(peer, "/odom", "nav_msgs/Odometry");
  advertise(second, "/odom", "std_msgs/String");
  EXPECT_TRUE(was_told(second, "the topic exists with the type nav_msgs/Odometry"));
  EXPECT_FALSE(advertises(second, "/odom"));
}

TEST_F(advertisements_test, are_known_by_one_number_each) {
  request first = of(peer, "/odom");
  first.tag = 1;
  writers.advertise(peer, first);
  request again = of(peer, "/odom");
  again.tag = 2;
  writers.advertise(peer, again);
  request other = of(peer, "/scan");
  other.tag = 1;
  writers.advertise(peer, other);
  EXPECT_EQ(told(peer).size(), 2U);
  EXPECT_EQ(advertised.find_tag({0}, 1), topics.find("/odom"));
  EXPECT_EQ(topics.count(), 1U);
}

TEST_F(advertisements_test, yield_to_the_type_of_a_handle_and_their_peers_are_told) {
  connection& second = join(1);
  advertise(peer, "/odom", "std_msgs/String");
  advertise(second, "/odom", "std_msgs/String");
  const topic_id topic = hold_as_own("/odom");
  writers.replace_type(topic, "nav_msgs/Odometry");
  EXPECT_EQ(topics.type(topic), "nav_msgs/Odometry");
  for (const connection* one : {&peer, &second}) {
    EXPECT_FALSE(advertises(*one, "/odom"));
    EXPECT_TRUE(
        was_told(*one, "has the type nav_msgs/Odometry here now; it was advertised as std_msgs/String"));
  }
}

TEST_F(advertisements_test, give_a_place_back_where_this_process_needs_it) {
  connection& second = join(1);
  for (int i = 0; i < 6; ++i) advertise(peer, "/first" + std::to_string(i));
  advertise(second, "/second");
  subscribe(second, "/first5");
  ASSERT_TRUE(writers.take_back_topic());
  EXPECT_EQ(topics.count(), 6U) << "of who holds most";
  EXPECT_TRUE(advertises(second, "/second"));
  EXPECT_FALSE(topics.find("/first5"));
  EXPECT_TRUE(was_told(peer, "the topic /first5 is given up"));
  EXPECT_TRUE(was_told(second, "the topic /first5 is given up")) << "all of its holders are told";
}

TEST_F(advertisements_test, give_back_no_topic_of_this_process) {
  advertise(peer, "/odom");
  (void)hold_as_own("/odom"); // so no peer holds it alone
  EXPECT_FALSE(writers.take_back_topic());
  EXPECT_TRUE(advertises(peer, "/odom"));
}

TEST_F(advertisements_test, of_one_peer_leave_each_other_one_its_claim) {
  for (int i = 0; i < 32; ++i) advertise(peer, "/first" + std::to_string(i));
  EXPECT_LT(places.held_by({0}), 32U);
  EXPECT_GT(places.held_by({0}), 4U);
  for (std::uint32_t other = 1; other < bounds.connections_max; ++other) {
    connection& late = join(other);
    for (int i = 0; i < 4; ++i) advertise(late, "/late" + std::to_string(other) + "/" + std::to_string(i));
    EXPECT_EQ(places.held_by({other}), 4U);
  }
}

} // namespace
} // namespace advertisements_test
