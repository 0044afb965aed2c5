// SPDX-License-Identifier: Apache-2.0
// Peers that came on the path of the stop: what they may do, what they are told of everything else, and when
// they lose their place.
#include "core_fixtures.hpp"

#include <rowe/stop_latch.hpp>

#include <optional>

namespace core_stop_path_test {
namespace {

using namespace harness;

struct stop_path : core_test {
  stop_path() : core_test{unguarded_hub_options()} {
    latch = on.open<rowe::stop_latch>(rowe::detail::latch_request({.name = "base"}));
  }
  peer& comes(std::string_view address = "10.0.0.7:50000") {
    return peers.emplace_back(on, rowe::service::side::server, address, rowe::service::stop_path);
  }
  // A cycle of the loop, then one of the service thread; true while the robot may move.
  bool look() {
    const bool engaged = latch->engaged(on.now);
    if (engaged) latch->acknowledge(on.now);
    on.cycle();
    return !engaged;
  }
  void start() {
    peer by{on};
    look();
    by.tell(R"({"op":"call_service","service":"/rowe/stop/state"})");
    const std::string state = member(by.hear().back(), "values");
    by.tell(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" +
            member(state, "number") + R"(,"tick":)" + member(state, "tick") + "}}");
    ASSERT_TRUE(look());
    by.leave();
    on.cycle();
  }
  // What is said to a text of this peer.
  texts answer_to(peer& of, std::string_view text) {
    of.tell(text);
    look();
    return of.hear();
  }

  std::optional<rowe::stop_latch> latch;
  std::deque<peer> peers;
};

TEST_F(stop_path, stops_by_either_codec_with_an_answer_or_without) {
  for (const auto& [text, answers] :
       {std::pair{R"({"op":"call_service","id":"1","service":"/rowe/stop","args":{"source":"hand"}})", 1U},
        {R"({"op":"publish","topic":"/rowe/stop","msg":{"source":"hand"}})", 0U},
        {R"({"service":"/rowe/stop","message_id":7})", 1U},
        {R"({"service":"rowe/stop"})", 0U},
        {R"({"op":"advertise","topic":7,"service":"/rowe/stop"})", 1U}}) { // wrong, but it means a stop
    start();
    peer& p = comes();
    EXPECT_EQ(answer_to(p, text).size(), answers) << text;
    EXPECT_FALSE(look()) << text;
    p.leave();
    on.cycle();
  }
}

TEST_F(stop_path, sees_the_state_by_asking_and_by_subscribing) {
  peer& p = comes();
  const std::string told =
      only(answer_to(p, R"({"op":"call_service","id":"1","service":"/rowe/stop/state"})"));
  EXPECT_EQ(member(member(told, "values"), "state"), "\"stopped\"");
  EXPECT_TRUE(has(answer_to(p, R"({"service":"/rowe/stop/state","message_id":1})").at(0), "\"tick\""));
  EXPECT_EQ(member(answer_to(p, R"({"op":"subscribe","topic":"/rowe/stop/state"})").at(0), "topic"),
            "\"/rowe/stop/state\"");
  EXPECT_GE(p.hear_after(1000).size(), 4U);
  EXPECT_TRUE(p.ask(R"({"op":"unsubscribe","topic":"/rowe/stop/state"})", 1000).empty());
}

TEST_F(stop_path, is_refused_everything_else_with_words_and_counted) {
  rowe::detail::queue_pair& inbox =
      on.offer_now(rowe::detail::pair_kind::subscribe_text, "/in", 200, {.depth = 16});
  start();
  peer& p = comes("127.0.0.1:50000"); // even from this machine
  for (const char* text :
       {R"({"op":"subscribe","topic":"/pose"})", R"({"op":"subscribe","topic":"/rowe/stats"})",
        R"({"op":"unsubscribe","topic":"/pose"})", R"({"op":"publish","topic":"/in","msg":{}})",
        R"({"op":"publish","topic":"/rowe/stop/state","msg":{}})", R"({"op":"advertise","topic":"/mine"})",
        R"({"op":"advertise","topic":"/rowe/stop"})", R"({"op":"unadvertise","topic":"/mine"})",
        R"({"op":"advertise_service","service":"/mine"})",
        R"({"op":"unadvertise_service","service":"/mine"})",
        R"({"op":"service_response","id":"1","service":"/x","result":true})",
        R"({"op":"set_level","level":"none"})", R"({"op":"status","level":"error","msg":"x"})",
        R"({"op":"no such thing"})", R"({"a":1})", R"({"service":"/mine"})",
        R"({"in_reply_to":"1","a":1})"}) {
    const auto before = on.count(counter::refused_requests);
    const auto said = answer_to(p, text);
    ASSERT_EQ(said.size(), 1U) << text;
    EXPECT_TRUE(has(said[0], "may only stop the robot")) << text << said[0];
    EXPECT_EQ(on.count(counter::refused_requests), before + 1) << text;
    for (int i = 0; i < 200; ++i) look(); // not more of them in a second than are said
  }
  for (const char* text :
       {R"({"op":"call_service","id":"1","service":"/rowe/stop/reset","args":{"number":1,"tick":1}})",
        R"({"op":"call_service","id":"1","service":"/rowe/stop/guard","args":{"guard":"x","tick":1}})",
        R"({"op":"call_service","id":"1","service":"/rowe/stats"})",
        R"({"op":"call_service","id":"1","service":"/rosapi/topics"})",
        R"({"service":"/rowe/stop/reset","message_id":1,"number":1,"tick":1})",
        R"({"service":"/anything","message_id":1})"}) {
    const auto before = on.count(counter::calls_refused);
    const auto said = answer_to(p, text);
    ASSERT_EQ(said.size(), 1U) << text;
    EXPECT_TRUE(has(said[0], "may only stop the robot")) << text << said[0];
    EXPECT_EQ(on.count(counter::calls_refused), before + 1) << text;
    for (int i = 0; i < 200; ++i) look();
  }
  EXPECT_TRUE(look()); // none of this was a stop
  EXPECT_FALSE(take(inbox));
  EXPECT_FALSE(on.inbox.try_receive(on.now));
  EXPECT_EQ(on.count(counter::stop_refusals), 0U);
}

TEST_F(stop_path, hears_nothing_that_is_said_to_everyone) {
  peer& p = comes();
  (void)answer_to(p, R"({"service":"rowe/stop"})"); // a plain message: any other peer would get some now
  (void)answer_to(p, R"({"a":1})");
  peer ordinary{on};
  (void)answer_to(ordinary, R"({"a":1})");
  const auto sent = on.submissions.submit(
      {.what = rowe::detail::entry::message, .stamped = on.now, .expires = rowe::rt::never},
      R"({"to":"everyone"})");
  ASSERT_TRUE(sent);
  on.cycles(3);
  EXPECT_EQ(ordinary.hear(), texts{R"({"to":"everyone"})"});
  EXPECT_EQ(p.hear(), texts{});
}

TEST_F(stop_path, is_pinged_as_others_are_and_cut_when_it_is_silent) {
  peer& p = comes();
  on.cycles(5, 1s);
  (void)p.hear();
  EXPECT_GT(p.pings, 0);
  p.answers_pings = false;
  on.cycles(20, 1s);
  EXPECT_TRUE(p.cut());
  EXPECT_EQ(on.count(counter::silent_peers), 1U);
}

TEST_F(stop_path, peer_may_be_displaced_but_for_a_second_after_it_stopped_the_robot) {
  start();
  peer& p = comes();
  peer ordinary{on};
  on.cycle();
  EXPECT_TRUE(on.core.may_displace(p.id()));
  EXPECT_FALSE(on.core.may_displace(ordinary.id()));
  (void)answer_to(p, R"({"service":"/rowe/stop"})");
  EXPECT_FALSE(on.core.may_displace(p.id()));
  on.cycles(9, 100ms);
  EXPECT_FALSE(on.core.may_displace(p.id()));
  on.cycles(1, 100ms);
  EXPECT_TRUE(on.core.may_displace(p.id()));
}

// Or two peers could keep both places by words that do nothing.
TEST_F(stop_path, peer_keeps_no_place_by_stopping_a_robot_that_stands) {
  start();
  peer& first = comes();
  peer& p = comes("10.0.0.8:50000");
  (void)answer_to(first, R"({"service":"/rowe/stop"})");
  for (int i = 0; i < 5; ++i) {
    (void)answer_to(p, R"({"service":"/rowe/stop","source":")" + std::to_string(i) + "\"}");
    EXPECT_TRUE(on.core.may_displace(p.id()));
    on.cycle(900ms);
  }
}

TEST_F(stop_path, peer_that_is_displaced_is_told_why) {
  peer& p = comes();
  on.cycle();
  on.core.displace(p.id());
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1013);
  on.cycle();
  EXPECT_TRUE(p.cut());
  EXPECT_EQ(on.count(counter::stop_peers_displaced), 1U);
}

struct without_a_stop : core_test {};

TEST_F(without_a_stop, the_path_leads_to_nothing_and_says_so) {
  peer p{on, rowe::service::side::server, "127.0.0.1:50000", rowe::service::stop_path};
  p.tell(R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
  EXPECT_TRUE(has(p.hear().at(0), "Service /rowe/stop does not exist"));
  p.tell(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  EXPECT_TRUE(has(p.hear().at(0), "may only stop"));
}

} // namespace
} // namespace core_stop_path_test
