// SPDX-License-Identifier: Apache-2.0
#include "service/state/subscription_table.hpp"

#include <gtest/gtest.h>

#include "wire/protocols/protocols.hpp"

namespace subscription_table_test {
namespace {

using rowe::service::subscription_table;
using rowe::service::topic_table;

struct subscription_table_test : testing::Test {
  rowe::limits bounds{.topics_max = 4, .subscriptions_max = 6};
  rowe::rt::arena memory{topic_table::footprint_bytes(bounds) + subscription_table::footprint_bytes(bounds),
                         rowe::rt::page_lock::none};
  topic_table topics{memory, bounds, rowe::wire::protocols_of(rowe::websocket_profile::standard).envelope};
  subscription_table table{memory, bounds, topics};
};

TEST_F(subscription_table_test, takes_no_more_memory_than_it_says) {
  EXPECT_EQ(memory.bytes_used(),
            topic_table::footprint_bytes(bounds) + subscription_table::footprint_bytes(bounds));
}

TEST_F(subscription_table_test, lists_subscriptions_by_topic_and_by_connection) {
  const auto t = topics.find_or_add("/t");
  const auto a = table.add(t, {0});
  const auto b = table.add(t, {1});
  EXPECT_EQ(table.find(t, {0}), a);
  EXPECT_EQ(table.find(t, {1}), b);
  EXPECT_EQ(topics.at(t).subscriptions.count, 2U);
  EXPECT_TRUE(table.check());
  table.remove(a);
  EXPECT_FALSE(table.find(t, {0}));
  EXPECT_EQ(topics.at(t).subscriptions.head, b);
}

TEST_F(subscription_table_test, refuses_a_subscription_more_than_its_limit_and_takes_places_back) {
  const auto t = topics.find_or_add("/t");
  topics.hold(t);
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(table.add(t, {0}));
  EXPECT_FALSE(table.add(t, {0}));
  EXPECT_EQ(table.count_of({0}), 6U);
  table.remove(table.first_of({0}));
  (void)topics.let_go(t); // the subscription's hold; five and ours are left
  EXPECT_TRUE(table.add(t, {0}));
  EXPECT_TRUE(table.check());
}

TEST_F(subscription_table_test, merges_requests_to_the_smallest_throttle_and_queue) {
  const auto t = topics.find_or_add("/t");
  auto& s = table.at(table.add(t, {0}));
  using std::chrono::milliseconds;
  s.requests[0] = {.id_hash = 1, .throttle = milliseconds{100}, .queue_length = 8};
  s.requests[1] = {.id_hash = 2, .throttle = milliseconds{50}, .queue_length = 0};
  s.requests[2] = {.id_hash = 3, .throttle = milliseconds{70}, .queue_length = 3};
  s.request_count = 3;
  table.merge(s, 256);
  EXPECT_EQ(s.throttle, milliseconds{50});
  EXPECT_EQ(s.depth, 3U);
  EXPECT_FALSE(s.discards);
}

TEST_F(subscription_table_test, discards_within_the_throttle_when_no_queue_was_asked_for) {
  const auto t = topics.find_or_add("/t");
  auto& s = table.at(table.add(t, {0}));
  s.requests[0] = {.id_hash = 1, .throttle = std::chrono::milliseconds{100}, .queue_length = 0};
  s.request_count = 1;
  table.merge(s, 256);
  EXPECT_TRUE(s.discards);
  EXPECT_EQ(s.depth, 1U);
}

TEST_F(subscription_table_test, keeps_only_the_newest_of_a_topic_that_says_so) {
  const auto t = topics.find_or_add("/t");
  topics.at(t).keep = rowe::keep::newest;
  auto& s = table.at(table.add(t, {0}));
  table.merge(s, 256);
  EXPECT_TRUE(s.merges);
  EXPECT_EQ(s.depth, 1U);
}

TEST_F(subscription_table_test, tells_the_two_spellings_of_a_name_apart) {
  const auto t = topics.find_or_add("/t");
  const auto with = table.add(t, {0});
  const auto without = table.add(t, {0});
  table.set_form(table.at(without), topics.envelope(), 7, true);
  EXPECT_EQ(table.find(t, {0}, false), with);
  EXPECT_EQ(table.find(t, {0}, true), without);
  EXPECT_TRUE(table.at(without).own_head) << "the text of the slot begins with the other name";
  EXPECT_FALSE(table.at(with).own_head);
}

} // namespace
} // namespace subscription_table_test
