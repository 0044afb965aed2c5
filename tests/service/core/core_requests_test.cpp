// SPDX-License-Identifier: Apache-2.0
// The core as a server: what peers ask for, how often they want to be told, and what they are refused.
#include "core_fixtures.hpp"

namespace harness {
namespace core_requests_test {
namespace {

struct core_gone : testing::Test {
  core_harness on{hub_options()};
};

// What is asked for the sake of its answer, in each way, and what it would have brought about.
TEST_F(core_gone, a_peer_that_has_gone_is_answered_nothing) {
  on.offer_now(rowe::detail::latch_request({.name = "loop"}));
  peer p{on};
  p.say(R"({"op":"advertise","topic":"/said","type":"a/B"})");
  peer other = subscriber(on, "/said");
  on.core.on_gone(p.id());
  (void)p.hear();
  (void)other.hear();
  constexpr std::string_view asked[] = {
      R"({"op":"call_service","id":"1","service":"/rosapi/topics"})",
      R"({"op":"call_service","id":"2","service":"/rowe/stats"})",
      R"({"op":"subscribe","topic":"/other"})",
      R"({"op":"unsubscribe","topic":"/other"})",
      R"({"op":"advertise_service","service":"/mine","type":"a/B"})",
      R"({"op":"advertise_action","action":"/mine_too","type":"a/B"})",
      R"({"op":"send_action_goal","id":"3","action":"/act","action_type":"a/B","args":{}})",
      R"({"op":"set_level","level":"none"})"};
  std::uint64_t count = 0;
  for (const std::string_view one : asked) {
    p.tell(one);
    EXPECT_EQ(on.count(counter::left_behind), ++count) << one;
    EXPECT_EQ(p.hear(), texts{}) << one;
  }
  p.tell(R"({"op":"publish","topic":"/said","msg":{"x":1}})");
  EXPECT_EQ(other.hear(), texts{R"({"op":"publish","topic":"/said","msg":{"x":1}})"}) << "others want that";
  p.tell(R"({"op":"call_service","id":"4","service":"/rowe/stop"})");
  EXPECT_EQ(on.count(counter::stops), 1U);
  EXPECT_EQ(on.count(counter::left_behind), count);
}

// Its side of the network answers what we write to nobody.
TEST_F(core_gone, calls_of_a_peer_that_ends_with_many_of_them_unread_are_not_all_carried_out) {
  peer p{on};
  on.net.link_of(p.id()).arrive_bytes_max = 1000;
  for (int i = 0; i < 500; ++i) p.say(R"({"op":"call_service","id":"1","service":"/rosapi/topics"})");
  p.leave();
  on.cycles(100);
  EXPECT_GT(on.count(counter::left_behind), 400U);
  EXPECT_GT(on.count(counter::calls_in), 480U) << "all were read, but for what came with the end";
}

struct throttling : core_test {
  // Publishes at 1 kHz for a while and returns what came.
  texts run(peer& to, rowe::detail::queue_pair& pair, int milliseconds) {
    texts all;
    for (int i = 0; i < milliseconds; ++i) {
      EXPECT_TRUE(publish_now(on, pair, {1.0 * ++x, 0}));
      for (auto& text : to.hear()) all.push_back(std::move(text));
    }
    return all;
  }
  int x = 0;
};

TEST_F(throttling, spaces_messages_by_the_throttle_rate) {
  auto& pair = advertise_pose(on);
  peer browser = peer_saying(on, R"({"op":"subscribe","topic":"/pose","throttle_rate":50})");
  EXPECT_EQ(run(browser, pair, 1000).size(), 20U);
  EXPECT_EQ(on.count(counter::throttled), 980U);
}

TEST_F(throttling, with_a_queue_of_one_sends_the_newest_value_when_it_is_due) {
  auto& pair = advertise_pose(on);
  peer browser =
      peer_saying(on, R"({"op":"subscribe","topic":"/pose","throttle_rate":100,"queue_length":1})");
  const texts heard = run(browser, pair, 500);
  ASSERT_GE(heard.size(), 5U);
  EXPECT_EQ(heard[0], message(1));
  EXPECT_EQ(heard[1], message(101)); // the newest at that time, not the oldest waiting
}

TEST_F(throttling, with_a_longer_queue_drops_the_oldest_and_drains_at_its_rate) {
  auto& pair = advertise_pose(on);
  peer browser = peer_saying(on, R"({"op":"subscribe","topic":"/pose","throttle_rate":10,"queue_length":3})");
  EXPECT_EQ(run(browser, pair, 5), texts{message(1)});
  texts heard = browser.hear_during(50);
  EXPECT_EQ(heard, (texts{message(3), message(4), message(5)}));
  EXPECT_EQ(on.count(counter::throttled), 1U); // as asked for, so no loss
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

TEST_F(throttling, takes_a_period_of_centuries_for_what_it_is) {
  auto& pair = advertise_pose(on);
  peer browser =
      peer_saying(on, R"({"op":"subscribe","topic":"/pose","throttle_rate":9223372036854,"queue_length":1})");
  EXPECT_EQ(run(browser, pair, 100), texts{message(1)});
}

TEST_F(throttling, counts_from_when_a_message_was_sent_that_was_ready_before_the_rate_changed) {
  auto& pair = advertise_pose(on);
  peer browser = peer_saying(on, R"({"op":"subscribe","topic":"/pose","throttle_rate":5,"queue_length":1})");
  EXPECT_EQ(run(browser, pair, 1).size(), 1U);
  on.net.link_of(browser.id()).capacity_bytes = 0;
  on.cycles(10);
  EXPECT_TRUE(run(browser, pair, 2).empty()); // the first waits for room, the second is behind it
  browser.tell(R"({"op":"subscribe","topic":"/pose","throttle_rate":1000,"queue_length":1})");
  on.net.link_of(browser.id()).capacity_bytes = 1 << 20;
  EXPECT_FALSE(browser.hear_after(1).empty());
  browser.tell(R"({"op":"subscribe","topic":"/pose"})");
  EXPECT_EQ(run(browser, pair, 5).size(), 5U);
}

TEST_F(throttling, merges_two_subscriptions_of_one_peer_into_one_copy) {
  auto& pair = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","id":"a","topic":"/pose","throttle_rate":100})");
  browser.say(R"({"op":"subscribe","id":"b","topic":"/pose"})");
  on.cycle();
  EXPECT_EQ(run(browser, pair, 10).size(), 10U);
  browser.tell(R"({"op":"unsubscribe","id":"b","topic":"/pose"})");
  EXPECT_LE(run(browser, pair, 50).size(), 1U);
  browser.tell(R"({"op":"unsubscribe","id":"a","topic":"/pose"})");
  EXPECT_EQ(publish(on, pair, {0, 0}).code(), rowe::errc::no_peer);
}

struct hub : core_test {
  hub() : core_test{hub_options()} {}
};

TEST_F(hub, relays_what_one_peer_publishes_to_those_that_subscribed_with_its_text_unchanged) {
  peer talker{on};
  peer listener{on};
  peer bystander{on};
  listener.tell(R"({"op":"subscribe","topic":"/chatter"})");
  talker.say(R"({"op":"advertise","topic":"/chatter","type":"std_msgs/String"})");
  talker.say(R"({"op":"publish","topic":"\/chatter","msg":{"data": 0.10000000000000001,"n":1e2}})");
  on.cycles(2);
  EXPECT_EQ(listener.hear(),
            texts{R"({"op":"publish","topic":"/chatter","msg":{"data": 0.10000000000000001,"n":1e2}})"});
  EXPECT_TRUE(bystander.hear().empty());
  EXPECT_TRUE(talker.hear().empty());
}

TEST_F(hub, relays_messages_too_large_for_a_small_slot) {
  peer talker{on};
  peer listener = subscriber(on, "/big");
  const std::string body = R"({"data":")" + std::string(6000, 'x') + R"("})";
  talker.tell(R"({"op":"publish","topic":"/big","msg":)" + body + "}", 2);
  EXPECT_EQ(listener.hear() == texts{R"({"op":"publish","topic":"/big","msg":)" + body + "}"}, true);
}

TEST_F(hub, keeps_topics_below_rowe_for_itself) {
  peer talker{on};
  talker.say(R"({"op":"publish","id":"p","topic":"/rowe/stats","msg":{}})");
  talker.say(R"({"op":"advertise","topic":"/rowe/stats","type":"a/B"})");
  const auto heard = talker.hear_after(1);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(has(heard[0], R"("op":"status","level":"error","id":"p")"));
}

TEST_F(core_test, does_not_relay_unless_it_is_a_hub) {
  peer talker{on};
  peer listener = subscriber(on, "/chatter");
  talker.tell(R"({"op":"publish","topic":"/chatter","msg":{}})", 2);
  EXPECT_TRUE(listener.hear().empty());
}

struct refusals : core_test {
  std::string answer(peer& of, std::string_view request) {
    const auto heard = of.ask(request);
    return heard.empty() ? "" : heard.back();
  }
};

TEST_F(refusals, answer_an_unknown_op_with_a_status_that_names_it) {
  peer p{on};
  EXPECT_EQ(answer(p, R"({"op":"jump","id":7})").substr(0, 40),
            R"({"op":"status","level":"error","id":7,"m)");
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
}

TEST_F(refusals, answer_what_is_not_json_and_go_on) {
  peer p{on};
  EXPECT_TRUE(has(answer(p, R"({"op":)"), "(at byte 6)"));
  EXPECT_EQ(on.count(counter::malformed), 1U);
  EXPECT_EQ(answer(p, R"({"op":"subscribe","topic":"/pose"})"), "");
}

TEST(refusal, names_the_limit_on_subscriptions_of_one_peer) {
  core_harness on{with_limits(small_options(), &limits::topics_max, 64)};
  peer p{on};
  for (int i = 0; i < 9; ++i) p.say(R"({"op":"subscribe","topic":"/t)" + std::to_string(i) + "\"}");
  const std::string heard = only(p.hear_after(1));
  EXPECT_TRUE(has(heard, "subscriptions_per_connection_max"));
}

TEST_F(refusals, name_the_limit_on_topics_and_free_their_places_with_the_peer) {
  std::vector<peer> peers;
  for (int i = 0; i < 3; ++i) peers.emplace_back(on);
  on.cycle();
  std::string last;
  for (int i = 0; i < 24; ++i) {
    last = answer(peers[static_cast<std::size_t>(i) / 8],
                  R"({"op":"subscribe","topic":"/t)" + std::to_string(i) + "\"}");
  }
  EXPECT_TRUE(has(last, "topics_max"));
  bool told = false;
  while (const auto what = on.shared.try_event()) {
    told = told || (what->what_kind == rowe::event::kind::limit &&
                    std::string_view{what->remedy} == "raise `limits::topics_max`");
  }
  EXPECT_TRUE(told);
  for (peer& p : peers) p.leave();
  on.cycles(2);
  peer fresh{on};
  on.cycle();
  EXPECT_EQ(answer(fresh, R"({"op":"subscribe","topic":"/new"})"), "");
}

TEST_F(refusals, name_the_limit_on_advertisements_and_take_them_back) {
  peer p{on};
  for (int i = 0; i < 4; ++i)
    p.say(R"({"op":"advertise","type":"a/B","topic":"/t)" + std::to_string(i) + "\"}");
  EXPECT_TRUE(p.hear_after(1).empty());
  EXPECT_TRUE(has(answer(p, R"({"op":"advertise","type":"a/B","topic":"/t9"})"),
                  "advertisements_per_connection_max"));
  EXPECT_EQ(answer(p, R"({"op":"unadvertise","topic":"/t0"})"), "");
  EXPECT_EQ(answer(p, R"({"op":"advertise","type":"a/B","topic":"/t9"})"), "");
  EXPECT_NE(answer(p, R"({"op":"unadvertise","topic":"/t0"})"), "");
}

TEST_F(refusals, are_silent_after_set_level_none) {
  peer p{on};
  EXPECT_EQ(answer(p, R"({"op":"set_level","level":"none"})"), "");
  EXPECT_EQ(answer(p, R"({"op":"jump"})"), "");
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
}

TEST_F(refusals, close_a_connection_that_sends_binary) {
  peer p{on};
  p.send(rowe::wire::opcode::binary, "x");
  (void)p.hear_after(1);
  EXPECT_EQ(p.close_code, 1003);
  EXPECT_TRUE(p.cut());
}

TEST_F(refusals, are_bounded_for_a_peer_that_does_not_read_its_answers) {
  peer rude{on};
  on.cycle();
  on.net.link_of(rude.id()).capacity_bytes = 0;
  for (int i = 0; i < 1000; ++i) rude.say("nonsense");
  on.cycles(20);
  EXPECT_LE(on.core.slots_in_use(), 20U);
  EXPECT_EQ(on.count(counter::refusals_unsaid), 1000 - on.options.limits.refusals_per_second_max);
  rude.leave();
  on.cycles(2);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

} // namespace
} // namespace core_requests_test
} // namespace harness
