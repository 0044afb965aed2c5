// SPDX-License-Identifier: Apache-2.0
#include "service/state/topic_table.hpp"

#include <gtest/gtest.h>

#include <string>

#include "wire/protocols/protocols.hpp"

namespace topic_table_test {
namespace {

using rowe::service::topic_table;

struct topic_table_test : testing::Test {
  rowe::limits bounds{.topics_max = 4};
  rowe::rt::arena memory{topic_table::footprint_bytes(bounds), rowe::rt::page_lock::none};
  topic_table routes{memory, bounds, rowe::wire::protocols_of(rowe::websocket_profile::standard).envelope};
};

TEST_F(topic_table_test, takes_no_more_memory_than_it_says) {
  EXPECT_EQ(memory.bytes_used(), topic_table::footprint_bytes(bounds));
}

TEST_F(topic_table_test, finds_a_topic_by_its_name) {
  const auto odom = routes.find_or_add("/odom");
  routes.hold(odom);
  EXPECT_EQ(routes.find("/odom"), odom);
  EXPECT_EQ(routes.find_or_add("/odom"), odom);
  EXPECT_FALSE(routes.find("/odo"));
  EXPECT_EQ(routes.name(odom), "/odom");
  EXPECT_EQ(routes.head(odom), R"({"op":"publish","topic":"/odom","msg":)");
}

TEST_F(topic_table_test, refuses_a_topic_more_than_its_limit) {
  for (int i = 0; i < 4; ++i) routes.hold(routes.find_or_add("/t" + std::to_string(i)));
  EXPECT_FALSE(routes.find_or_add("/one-more"));
  EXPECT_TRUE(routes.check());
}

TEST_F(topic_table_test, refuses_a_name_longer_than_its_limit) {
  EXPECT_FALSE(routes.find_or_add(std::string(bounds.topic_bytes_max + 1, 'x')));
}

TEST_F(topic_table_test, has_room_for_the_longest_head_and_refuses_a_name_that_needs_more) {
  const auto longest = routes.find_or_add("/" + std::string(bounds.topic_bytes_max - 1, '"'));
  ASSERT_TRUE(longest);
  EXPECT_TRUE(routes.head(longest).ends_with(R"(","msg":)"));
  routes.hold(longest);
  EXPECT_FALSE(routes.find_or_add("/" + std::string(bounds.topic_bytes_max - 1, '\x01')));
  EXPECT_EQ(routes.count(), 1U);
  EXPECT_TRUE(routes.check());
}

TEST_F(topic_table_test, frees_a_topics_place_when_the_last_holder_lets_go) {
  for (int round = 0; round < 100; ++round) {
    const auto t = routes.find_or_add("/t" + std::to_string(round));
    ASSERT_TRUE(t);
    routes.hold(t);
    routes.hold(t);
    EXPECT_FALSE(routes.let_go(t));
    EXPECT_TRUE(routes.let_go(t));
    ASSERT_TRUE(routes.check());
  }
  EXPECT_EQ(routes.count(), 0U);
}

TEST_F(topic_table_test, keeps_the_type_a_topic_was_first_given) {
  const auto t = routes.find_or_add("/t");
  routes.hold(t);
  EXPECT_TRUE(routes.set_type(t, ""));
  EXPECT_TRUE(routes.set_type(t, "a/B"));
  EXPECT_TRUE(routes.set_type(t, "a/B"));
  EXPECT_TRUE(routes.set_type(t, ""));
  EXPECT_FALSE(routes.set_type(t, "a/C"));
  EXPECT_EQ(routes.type(t), "a/B");
}

} // namespace
} // namespace topic_table_test
