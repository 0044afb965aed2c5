// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/refusals.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/incoming/peer_parts.hpp"

namespace refusals_test {
namespace {

using namespace peer_parts;
using rowe::event;
using rowe::service::refusals;

struct refusals_test : peer_parts::peer_parts {
  refusals_test()
      : peer_parts{::state_fixture::with({.connections_max = 2,
                                          .message_bytes_max = 1024,
                                          .messages_per_second_max = 10,
                                          .refusals_per_second_max = 10,
                                          .small_slots = 256,
                                          .small_slot_bytes = 512,
                                          .large_slots = 1,
                                          .lanes_max = 1})} {}

  connection& peer = join(0);

  void refuse(connection& c, int count = 1) {
    while (count-- > 0) refused.refuse(c, {}, "no");
  }
  // Does so for longer than a flood may last, without a pause.
  void refuse_for_long(connection& c, int per_step) {
    for (const auto end = cycle.now + rowe::service::flood_time_max + 2s; cycle.now < end; cycle.now += 100ms)
      refuse(c, per_step);
  }
  std::uint64_t unsaid() const { return counts.read(counter::refusals_unsaid); }
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

TEST_F(refusals_test, are_counted_and_not_said_beyond_their_rate) {
  refuse(peer, 15);
  EXPECT_EQ(told(peer).size(), 10U);
  EXPECT_EQ(unsaid(), 5U);
  EXPECT_EQ(counts.read(counter::refused_requests), 10U);
  cycle.now += 100ms; // there is one more each tenth of a second
  refuse(peer, 2);
  EXPECT_EQ(told(peer).size(), 11U);
}

TEST_F(refusals_test, of_one_peer_leave_another_its_own) {
  connection& other = join(1);
  refuse(peer, 15);
  refuse(other);
  EXPECT_EQ(told(other).size(), 1U);
}

TEST_F(refusals_test, begin_anew_with_the_next_peer_at_the_same_place) {
  refuse(peer, 15);
  (void)events();
  refused.set_level({0}, rowe::wire::severity::none);
  refused.open({0});
  const std::size_t before = told(peer).size();
  refuse(peer);
  EXPECT_EQ(told(peer).size(), before + 1);
  EXPECT_EQ(events().size(), 1U);
  refused.report_missed(peer);
  EXPECT_TRUE(events().empty()) << "of what its predecessor was refused";
}

TEST_F(refusals_test, are_said_to_a_server_however_many_there_are) {
  peer.ours = rowe::service::side::client;
  refuse_for_long(peer, 3);
  EXPECT_EQ(unsaid(), 0U);
  EXPECT_TRUE(peer.open());
}

TEST_F(refusals_test, close_a_peer_that_goes_on) {
  refuse_for_long(peer, 3);
  EXPECT_FALSE(peer.open());
  EXPECT_TRUE(peers.wants_close()) << "when this part has returned";
  EXPECT_EQ(counts.read(counter::flooding_peers), 1U) << "and it counts once";
  EXPECT_NE(peer.close_reason.find("more than 10 refused requests a second for 5 s"), std::string::npos);
  EXPECT_NE(peer.close_reason.find("refusals_per_second_max"), std::string::npos);
}

TEST_F(refusals_test, close_no_peer_that_pauses) {
  for (int i = 0; i < 8; ++i) {
    refuse(peer, 15);
    cycle.now += 1s;
  }
  EXPECT_GT(unsaid(), 0U);
  EXPECT_TRUE(peer.open());
}

TEST_F(refusals_test, close_no_peer_that_stays_within_its_rate) {
  refuse_for_long(peer, 1);
  EXPECT_EQ(unsaid(), 0U);
  EXPECT_TRUE(peer.open());
}

TEST_F(refusals_test, are_events_one_by_one_and_then_a_number) {
  constexpr int burst = rowe::service::refusal_events_burst;
  refuse(peer, burst + 4);
  EXPECT_EQ(events().size(), std::size_t{burst});
  refused.report_missed(peer);
  EXPECT_TRUE(events().empty()) << "there were enough in this second";
  cycle.now += 1s;
  refused.report_missed(peer);
  const auto happened = events();
  ASSERT_EQ(happened.size(), 1U);
  EXPECT_EQ(std::string_view{happened[0].what}, "4 more requests were refused");
  cycle.now += 1s;
  refused.report_missed(peer);
  EXPECT_TRUE(events().empty()) << "that was said";
}

TEST_F(refusals_test, are_warnings_within_the_rate_and_statuses_at_any) {
  refuse(peer, 10);
  refused.warn(peer, {}, "less than you expect");
  EXPECT_FALSE(was_told(peer, "less than you expect"));
  EXPECT_EQ(unsaid(), 1U);
  refused.send_status(peer, {}, "this must be said");
  EXPECT_TRUE(was_told(peer, "this must be said"));
  EXPECT_EQ(counts.read(counter::refused_requests), 10U) << "neither is a refusal";
}

TEST_F(refusals_test, of_a_call_with_a_number_answer_the_call) {
  rowe::wire::request asked;
  asked.codec = peer.protocol->first.id();
  asked.what = rowe::wire::verb::call;
  asked.service = "/add";
  refused.refuse(peer, asked, {.code = "bad_request", .text = "without"});
  EXPECT_EQ(counts.read(counter::calls_refused), 0U);
  asked.id_raw = "\"9\"";
  refused.refuse(peer, asked, {.code = "bad_request", .text = "by name"});
  EXPECT_EQ(counts.read(counter::calls_refused), 1U);
  asked.what = rowe::wire::verb::send_goal;
  refused.refuse(peer, asked, {.code = "bad_request", .text = "a goal"});
  EXPECT_EQ(counts.read(counter::calls_refused), 2U);
  asked.what = rowe::wire::verb::call;
  asked.id_raw = {};
  asked.by_number = true;
  refused.refuse(peer, asked, {.code = "bad_request", .text = "by number"});
  EXPECT_EQ(counts.read(counter::calls_refused), 3U);
  EXPECT_TRUE(was_told(peer, "by number"));
}

} // namespace
} // namespace refusals_test
