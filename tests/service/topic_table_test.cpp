// SPDX-License-Identifier: Apache-2.0
#include "service/topic_table.hpp"

#include <gtest/gtest.h>

#include <string>

#include "wire/protocols.hpp"

namespace topic_table_test {
namespace {

using rowe::service::topic_table;

rowe::limits few() {
  rowe::limits bounds;
  bounds.topics_max = 4;
  bounds.subscriptions_max = 6;
  return bounds;
}

struct topic_table_test : testing::Test {
  rowe::limits bounds = few();
  rowe::rt::arena memory{topic_table::footprint_bytes(bounds), rowe::rt::page_lock::none};
  topic_table routes{memory, bounds, rowe::wire::protocols_of(rowe::peer_profile::standard).envelope};
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
  EXPECT_EQ(routes.topic_count(), 0U);
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

TEST_F(topic_table_test, lists_subscriptions_by_topic_and_by_connection) {
  const auto t = routes.find_or_add("/t");
  const auto a = routes.add_subscription(t, {0});
  const auto b = routes.add_subscription(t, {1});
  EXPECT_EQ(routes.find_subscription(t, {0}), a);
  EXPECT_EQ(routes.find_subscription(t, {1}), b);
  EXPECT_EQ(routes.at(t).subscriptions, 2U);
  EXPECT_TRUE(routes.check());
  routes.remove_subscription(a);
  EXPECT_FALSE(routes.find_subscription(t, {0}));
  EXPECT_EQ(routes.at(t).first_subscription, b);
}

TEST_F(topic_table_test, refuses_a_subscription_more_than_its_limit_and_takes_places_back) {
  const auto t = routes.find_or_add("/t");
  routes.hold(t);
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(routes.add_subscription(t, {0}));
  EXPECT_FALSE(routes.add_subscription(t, {0}));
  routes.remove_subscription(routes.first_subscription({0}));
  (void)routes.let_go(t); // the subscription's hold; five and ours are left
  EXPECT_TRUE(routes.add_subscription(t, {0}));
}

TEST_F(topic_table_test, merges_requests_to_the_smallest_throttle_and_queue) {
  const auto t = routes.find_or_add("/t");
  auto& s = routes.subscription_at(routes.add_subscription(t, {0}));
  using std::chrono::milliseconds;
  s.requests[0] = {.id_hash = 1, .throttle = milliseconds{100}, .queue_length = 8};
  s.requests[1] = {.id_hash = 2, .throttle = milliseconds{50}, .queue_length = 0};
  s.requests[2] = {.id_hash = 3, .throttle = milliseconds{70}, .queue_length = 3};
  s.request_count = 3;
  routes.merge(s, 256);
  EXPECT_EQ(s.throttle, milliseconds{50});
  EXPECT_EQ(s.depth, 3U);
  EXPECT_FALSE(s.discards);
}

TEST_F(topic_table_test, discards_within_the_throttle_when_no_queue_was_asked_for) {
  const auto t = routes.find_or_add("/t");
  auto& s = routes.subscription_at(routes.add_subscription(t, {0}));
  s.requests[0] = {.id_hash = 1, .throttle = std::chrono::milliseconds{100}, .queue_length = 0};
  s.request_count = 1;
  routes.merge(s, 256);
  EXPECT_TRUE(s.discards);
  EXPECT_EQ(s.depth, 1U);
}

TEST_F(topic_table_test, keeps_only_the_newest_of_a_topic_that_says_so) {
  const auto t = routes.find_or_add("/t");
  routes.at(t).keep = rowe::keep::newest;
  auto& s = routes.subscription_at(routes.add_subscription(t, {0}));
  routes.merge(s, 256);
  EXPECT_TRUE(s.merges);
  EXPECT_EQ(s.depth, 1U);
}

} // namespace
} // namespace topic_table_test
