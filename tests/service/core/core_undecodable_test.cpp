// SPDX-License-Identifier: Apache-2.0
// Messages that no handle can take: who is told of them, what, and how often.
#include <rowe/ros.hpp>

#include "core_fixtures.hpp"

namespace harness {
namespace core_undecodable_test {
namespace {

using rowe::event;
using rowe::detail::pair_kind;
using rowe::service::side;

constexpr const char* part = R"({"op":"publish","id":"p","topic":"/cmd_vel","msg":{"linear":{"x":0.1}}})";
constexpr const char* told =
    R"({"op":"status","level":"error","id":"p","msg":"publish /cmd_vel: the member \"linear.y\" is )"
    R"(missing; a number is wanted"})";

constexpr rowe::topic_options strict{.fill_missing = false};

rowe::detail::queue_pair& subscribe_twist(core_harness& on, const rowe::topic_options& how = strict,
                                          std::string_view topic = "/cmd_vel") {
  return on.offer(pair_kind::subscribe_value, topic, sizeof(rowe::ros::twist), how,
                  &rowe::describe<rowe::ros::twist>(), "geometry_msgs/Twist");
}

std::vector<event> events(core_harness& on, event::kind of) {
  std::vector<event> all;
  while (const auto one = on.shared.try_event()) {
    if (one->what_kind == of) all.push_back(*one);
  }
  return all;
}

struct core_undecodable : core_test {
  core_undecodable() {
    subscribe_twist(on);
    on.cycle();
  }
};

TEST_F(core_undecodable, tells_the_peer_and_this_process_which_member_is_wrong) {
  peer p{on};
  EXPECT_EQ(p.ask(part, 2), texts{told});
  EXPECT_EQ(on.count(counter::undecodable), 1U);
  const auto happened = events(on, event::kind::refused_request);
  ASSERT_EQ(happened.size(), 1U);
  EXPECT_EQ(std::string_view{happened[0].what},
            R"(publish /cmd_vel: the member "linear.y" is missing; a number is wanted)");
  EXPECT_EQ(std::string_view{happened[0].peer}, "127.0.0.1:50000");
  EXPECT_TRUE(has(std::string_view{happened[0].remedy}, "fill_missing"));
}

TEST_F(core_undecodable, tells_of_a_hub_as_well) {
  core_harness hub{hub_options()};
  subscribe_twist(hub);
  hub.cycle();
  peer p{hub}, listener{hub};
  listener.tell(R"({"op":"subscribe","topic":"/cmd_vel"})");
  p.tell(part, 2);
  EXPECT_EQ(p.hear(), texts{told});
  EXPECT_EQ(listener.hear().size(), 1U); // relayed all the same, and it is told nothing
  EXPECT_EQ(events(hub, event::kind::refused_request).size(), 1U);
}

TEST_F(core_undecodable, tells_once_a_second_and_counts_the_rest) {
  peer p{on};
  texts heard;
  for (int i = 0; i < 2500; ++i) { // 2.5 s
    p.tell(part);
    for (auto& text : p.hear()) heard.push_back(std::move(text));
  }
  EXPECT_EQ(heard, (texts{told, told, told}));
  EXPECT_EQ(events(on, event::kind::refused_request).size(), 3U);
  EXPECT_EQ(on.count(counter::undecodable), 2500U);
}

TEST_F(core_undecodable, tells_each_peer_whatever_another_has_sent) {
  peer noisy{on};
  for (int i = 0; i < 100; ++i) noisy.say(part);
  EXPECT_EQ(noisy.hear_after(2).size(), 1U);
  peer other{on};
  EXPECT_EQ(other.ask(part, 2), texts{told});
  EXPECT_EQ(events(on, event::kind::refused_request).size(), 1U); // of the topic
}

// A peer that changes topics all the time is told of two, and of the others when their turn has come.
TEST_F(core_undecodable, tells_a_peer_of_few_topics_a_second) {
  core_harness wide{with_limits(small_options(), &limits::handles_max, 12)};
  std::vector<std::string> topics;
  for (char c = 'a'; c < 'k'; ++c) {
    topics.push_back(std::string{"/"} + c);
    subscribe_twist(wide, {.depth = 2, .fill_missing = false}, topics.back());
    wide.cycle();
  }
  peer p{wide};
  std::size_t statuses = 0;
  for (int i = 0; i < 990; ++i) {
    p.tell(R"({"op":"publish","topic":")" + topics[static_cast<std::size_t>(i) % 10] + R"(","msg":{}})");
    statuses += p.hear().size();
  }
  EXPECT_EQ(statuses, 2U);
  wide.cycle(1s);
  EXPECT_EQ(p.ask(R"({"op":"publish","topic":"/j","msg":{}})").size(), 1U);
}

TEST_F(core_undecodable, says_nothing_to_a_peer_that_wants_no_status) {
  peer p{on};
  p.say(R"({"op":"set_level","level":"none"})");
  p.say(part);
  EXPECT_TRUE(p.hear_after(2).empty());
  EXPECT_EQ(events(on, event::kind::refused_request).size(), 1U);
}

TEST_F(core_undecodable, fills_in_what_is_missing_in_types_of_ros) {
  core_harness lenient;
  auto& pair = subscribe_twist(lenient, {});
  lenient.cycle();
  peer p{lenient};
  EXPECT_TRUE(p.ask(part).empty());
  rowe::subscriber<rowe::ros::twist> velocity{core_harness::handle_of(pair)};
  const auto taken = velocity.try_take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->value().linear.x, 0.1);
  EXPECT_EQ(taken->value().angular.z, 0);
  // What is wrong is not missing.
  p.tell(R"({"op":"publish","topic":"cmd_vel","msg":{"linear":{"x":"fast"}}})");
  EXPECT_EQ(
      p.hear(),
      texts{R"({"op":"status","level":"error","msg":"publish /cmd_vel: the member \"linear.x\" must be a )"
            R"(number; it is \"fast\""})"});
}

TEST_F(core_undecodable, tells_of_texts_that_are_too_long) {
  on.offer_now(pair_kind::subscribe_text, "/t", 10);
  peer p = peer_saying(on, R"({"op":"publish","topic":"/t","msg":{"data":"too long for it"}})");
  EXPECT_EQ(
      p.hear(),
      texts{R"({"op":"status","level":"error","msg":"publish /t: the message has 26 bytes, its subscriber )"
            R"(takes 10: raise the option `text_bytes_max`"})"});
  EXPECT_EQ(on.count(counter::too_big), 1U);
}

TEST_F(core_undecodable, warns_of_what_this_process_publishes_itself) {
  auto& pair = on.offer_now(pair_kind::publish_text, "cmd_vel", 100);
  ASSERT_TRUE(publish_text_now(on, pair, R"({"linear":7})"));
  const auto happened = events(on, event::kind::warning);
  ASSERT_EQ(happened.size(), 1U);
  EXPECT_EQ(std::string_view{happened[0].what},
            R"(publish /cmd_vel: the member "linear" must be an object; it is 7)");
}

TEST_F(core_undecodable, warns_as_a_client_and_answers_nothing) {
  core_harness client{small_options(), side::client};
  subscribe_twist(client);
  client.cycle();
  peer server{client, side::client};
  (void)server.hear_after(2);
  for (int i = 0; i < 3; ++i) server.say(part);
  EXPECT_TRUE(server.hear_after(2).empty());
  EXPECT_EQ(events(client, event::kind::warning).size(), 1U);
  EXPECT_EQ(client.count(counter::undecodable), 3U);
}

TEST_F(core_undecodable, shows_the_words_of_a_servers_status) {
  core_harness client{small_options(), side::client};
  peer server{client, side::client};
  server.tell(told, 2);
  const auto happened = events(client, event::kind::status_from_peer);
  ASSERT_EQ(happened.size(), 1U);
  EXPECT_EQ(std::string_view{happened[0].what},
            R"(publish /cmd_vel: the member "linear.y" is missing; a number is wanted)");
}

// ---- texts that are no JSON

struct malformed_texts : core_test {
  texts answer(std::string_view text) {
    peer fresh{on};
    texts heard = fresh.ask(text);
    fresh.leave();
    on.cycle();
    return heard;
  }
};

TEST_F(malformed_texts, are_answered_by_the_codec_that_can_be_seen_in_them) {
  for (const char* text :
       {R"({"op":"publish","topic":"/x","msg":{"d":NaN}})",
        R"({ "topic": "/x", "msg": {"d": NaN}, "op" : "publish" })", R"({"op":"subscribe","topic":"/x")",
        R"( {"op":"hop","a":NaN})", R"({'a':1, "op":"call_service"})"}) {
    const texts heard = answer(text);
    ASSERT_EQ(heard.size(), 1U) << text;
    EXPECT_TRUE(heard[0].starts_with(R"({"op":"status","level":"error","msg":")")) << heard[0];
    EXPECT_TRUE(has(heard[0], "the text is no valid JSON"));
  }
  for (const char* text :
       {"nonsense", R"({"a":NaN})", R"({"op":1,"a":NaN})", R"({"a":NaN,"op":"hop"})",
        R"({"service":"/a","message_id":"1","a":NaN})", R"("op" "publish")", R"({"op":)"}) {
    const texts heard = answer(text);
    ASSERT_EQ(heard.size(), 1U) << text;
    EXPECT_TRUE(heard[0].starts_with(R"({"error":{"code":"malformed",)")) << heard[0];
  }
}

TEST_F(malformed_texts, that_show_nothing_are_answered_by_the_codec_used_last) {
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/x"})");
  p.say("{");
  p.say(R"({"message_id":1,"a":NaN})");
  const texts heard = p.hear_after(1);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(heard[0].starts_with(R"({"op":"status")")) << heard[0];
  EXPECT_TRUE(heard[1].starts_with(R"({"error":)")) << heard[1];
}

TEST_F(malformed_texts, with_numbers_that_json_lacks_are_told_what_to_send_instead) {
  for (const auto& [number, word] :
       {std::pair{"NaN", "NaN"}, std::pair{"Infinity", "Infinity"}, std::pair{"-Infinity", "Infinity"}}) {
    const std::string text = R"({"op":"publish","topic":"/x","msg":{"d":)" + std::string{number} + "}}";
    const auto at = std::to_string(text.find(word));
    EXPECT_EQ(answer(text),
              texts{R"({"op":"status","level":"error","msg":"publish /x: the text is no valid JSON, )"
                    "which has no " +
                    std::string{word} + " (at byte " + at + R"(): send null, or leave the member out"})"});
  }
}

// Who calls waits for an answer under its id, so what stands in front of the fault is read.
TEST_F(malformed_texts, fail_the_call_or_the_goal_that_can_be_seen_in_them) {
  struct row {
    const char* text;
    const char* answer;
    const char* reason;
  };
  constexpr row rows[] = {
      {R"({"op":"call_service","id":"n1","service":"/rosapi/topics","args":{"x":NaN}})",
       R"({"op":"service_response","id":"n1","service":"/rosapi/topics","result":false,"values":")",
       "which has no NaN (at byte 70)"},
      {R"({"op":"call_service","id":"n2","args":[1,)",
       R"({"op":"service_response","id":"n2","result":false,"values":")", "no valid JSON"},
      {R"({"id":3,"service":"/a","op":"call_service","args":{"x":01}})",
       R"({"op":"service_response","id":3,"service":"/a","result":false,"values":")", "no valid JSON"},
      {R"({"op":"send_action_goal","id":"g1","action":"/fly","args":{"x":-Infinity}})",
       R"({"op":"action_result","id":"g1","action":"/fly","status":0,"result":false,"values":")",
       "which has no Infinity"},
      {R"({"message_id":"b1","service":"/a","x":NaN})", R"({"error":{"code":"malformed","text":")",
       R"("in_reply_to":"b1"})"},
      {R"({"op":"subscribe","id":"s1","topic":"/t","type":nil})",
       R"({"op":"status","level":"error","id":"s1","msg":"subscribe /t: )", "no valid JSON"},
  };
  for (const row& one : rows) {
    const texts heard = answer(one.text);
    ASSERT_EQ(heard.size(), 1U) << one.text;
    EXPECT_TRUE(heard[0].starts_with(one.answer) && has(heard[0], one.reason)) << heard[0];
  }
  EXPECT_EQ(on.count(counter::malformed), std::size(rows));
  EXPECT_EQ(on.count(counter::calls_refused), std::size(rows) - 1);
  const texts behind = answer(R"({"op":"call_service","args":NaN,"id":"n3","service":"/a"})");
  ASSERT_EQ(behind.size(), 1U);
  EXPECT_TRUE(has(behind[0], R"("op":"status")") && !has(behind[0], "n3")) << "what is behind is not read";
}

TEST_F(malformed_texts, that_answer_a_call_fail_it) {
  core_harness hub{hub_options()};
  peer arm{hub}, page{hub};
  arm.tell(R"({"op":"advertise_service","service":"/grip","type":"x/Y"})");
  page.tell(R"({"op":"call_service","id":"c1","service":"/grip"})", 2);
  const std::string asked = only(arm.hear());
  const std::size_t id = asked.find(R"("id":")");
  ASSERT_NE(id, std::string::npos) << asked;
  const std::string member = asked.substr(id, asked.find('"', id + 6) + 1 - id);
  arm.tell(
      R"({"op":"service_response",)" + member + R"(,"service":"/grip","result":true,"values":{"x":NaN}})", 2);
  const std::string heard = only(page.hear());
  EXPECT_TRUE(heard.starts_with(R"({"op":"service_response","id":"c1","service":"/grip","result":false,)"))
      << heard;
  EXPECT_TRUE(has(heard, "which has no NaN"));
}

} // namespace
} // namespace core_undecodable_test
} // namespace harness
