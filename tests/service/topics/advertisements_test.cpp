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

  bool advertises(const connection& c, std::string_view topic) {
    const topic_id found = topics.find(topic);
    return found && advertised.find({c.id.index}, found) != nullptr;
  }
};

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

} // namespace
} // namespace advertisements_test
