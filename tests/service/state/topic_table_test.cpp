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

} // namespace
} // namespace topic_table_test
