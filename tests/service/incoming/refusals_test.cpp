// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/refusals.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/incoming/peer_parts.hpp"

namespace refusals_test {
namespace {

using namespace peer_parts;
using rowe::event;

struct refusals_test : peer_parts::peer_parts {
  refusals_test()
      : peer_parts{::state_fixture::with({.connections_max = 2,
                                          .message_bytes_max = 1024,
                                          .messages_per_second_max = 10,
                                          .refusals_per_second_max = 10,
                                          .small_slots = 256,
                                          .small_slot_bytes = 512,
                                          .large_slots = 1,
                                          .handles_max = 1})} {}

  connection& peer = join(0);
};

TEST_F(refusals_test, tell_the_peer_which_limit_it_is_and_the_user_to_raise_it) {
  refused.refuse_limit(peer, "\"7\"", "topics", 36, "topics_max");
  ASSERT_EQ(told(peer).size(), 1U);
  EXPECT_TRUE(was_told(peer, "all 36 topics are taken (limit topics_max)"));
  EXPECT_TRUE(was_told(peer, "\"7\"")) << "under the id of the request";
  const auto happened = events();
  ASSERT_EQ(happened.size(), 1U);
  EXPECT_EQ(happened[0].what_kind, event::kind::limit);
  EXPECT_EQ(std::string_view{happened[0].remedy}, "raise `limits::topics_max`");
  EXPECT_EQ(counts.read(counter::refused_requests), 1U);
}

TEST_F(refusals_test, say_what_a_peer_holds_and_what_is_kept_for_others) {
  rowe::wire::request asked;
  asked.verb_text = "subscribe";
  asked.topic = "/odom";
  refused.refuse_share(
      peer, asked,
      {.what = "topics", .held = 9, .left = 5, .for_peers = 32, .kept = 8, .option = "topics_max"});
  EXPECT_TRUE(was_told(peer,
                       "subscribe /odom: one peer may hold no more topics than it leaves free: it holds 9, "
                       "5 of 32 are left, 5 of them reserved"))
      << "no more can be kept than are left";
  refused.refuse_share(
      peer, asked,
      {.what = "topics", .held = 9, .left = 5, .for_peers = 32, .kept = 0, .option = "topics_max"});
  EXPECT_EQ(told(peer)[1].find("kept"), std::string::npos);
}

TEST_F(refusals_test, are_short_however_long_the_name_is_that_they_repeat) {
  rowe::wire::request asked;
  asked.verb_text = "subscribe";
  const std::string name(128, 'x');
  asked.topic = name;
  refused.refuse_share(
      peer, asked,
      {.what = "topics", .held = 9, .left = 5, .for_peers = 32, .kept = 1, .option = "topics_max"});
  EXPECT_TRUE(was_told(peer, std::string(96, 'x') + "...: one peer")) << "and what follows is whole";
  EXPECT_TRUE(was_told(peer, "(limit topics_max)"));
}

TEST_F(refusals_test, close_a_peer_that_goes_on) {
  // For longer than a flood may last, without a pause.
  for (const auto end = cycle.now + rowe::service::flood_time_max + 2s; cycle.now < end; cycle.now += 100ms)
    for (int i = 0; i < 3; ++i) refused.refuse(peer, {}, "no");
  EXPECT_FALSE(peer.open());
  EXPECT_TRUE(peers.wants_close()) << "when this part has returned";
  EXPECT_EQ(counts.read(counter::flooding_peers), 1U) << "and it counts once";
  EXPECT_NE(peer.close_reason.find("more than 10 refused requests a second for 5 s"), std::string::npos);
  EXPECT_NE(peer.close_reason.find("refusals_per_second_max"), std::string::npos);
}

TEST_F(refusals_test, close_no_peer_that_pauses) {
  for (int i = 0; i < 8; ++i) {
    for (int count = 0; count < 15; ++count) refused.refuse(peer, {}, "no");
    cycle.now += 1s;
  }
  EXPECT_GT(counts.read(counter::refusals_unsaid), 0U);
  EXPECT_TRUE(peer.open());
}

} // namespace
} // namespace refusals_test
