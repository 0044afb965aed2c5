// SPDX-License-Identifier: Apache-2.0
// One topic by two names, and one type by two: "pose" and "/pose", "test_msgs/msg/Pose" and "test_msgs/Pose".
// Whatever a peer calls a topic is what it is sent.
#include <rowe/ros.hpp>

#include "core_fixtures.hpp"
#include "service/base/names.hpp"

namespace harness {
namespace core_names_test {
namespace {

using rowe::detail::pair_kind;
using rowe::detail::pair_phase;
using rowe::service::side;

// All that comes while the peer reads so many bytes in each of so many cycles.
texts read_slowly(core_harness& on, peer& by, std::size_t bytes, int cycles = 400) {
  texts all;
  for (int i = 0; i < cycles; ++i) {
    on.net.link_of(by.id()).capacity_bytes = bytes;
    for (auto& text : by.hear_after(1)) all.push_back(std::move(text));
  }
  return all;
}

struct core_names : core_test {
  core_names() { on.cycle(); }
};

std::string unslashed(int x) {
  return R"({"op":"publish","topic":"pose","msg":{"x":)" + std::to_string(x) + R"(,"y":0}})";
}

TEST(names, are_one_with_a_slash_and_without) {
  using rowe::service::without_slash;
  EXPECT_EQ(without_slash("/a"), without_slash("a"));
  EXPECT_NE(without_slash("//a"), without_slash("/a"));
  EXPECT_EQ(without_slash("/"), "/");
}

TEST(names, of_types_are_one_with_their_kind_and_without) {
  using rowe::service::hash_of_type;
  using rowe::service::same_type;
  for (const auto& [a, b] : {std::pair{"geometry_msgs/msg/Twist", "geometry_msgs/Twist"},
                             std::pair{"std_srvs/srv/SetBool", "std_srvs/SetBool"}, std::pair{"x", "x"},
                             std::pair{"a/b/c", "a/b/c"}}) {
    EXPECT_TRUE(same_type(a, b) && same_type(b, a)) << a;
    EXPECT_EQ(hash_of_type(a), hash_of_type(b)) << a;
  }
  for (const auto& [a, b] :
       {std::pair{"geometry_msgs/Twist", "geometry_msgs/Pose"}, std::pair{"a/msg/X", "a/srv/X"},
        std::pair{"a/msg/X", "b/msg/X"}, std::pair{"a/other/X", "a/X"}, std::pair{"msg/X", "X"},
        std::pair{"", "a/X"}, std::pair{"a/msg/msg/X", "a/msg/X"}, std::pair{"/msg/X", "X"}}) {
    EXPECT_FALSE(same_type(a, b) || same_type(b, a)) << a << ' ' << b;
  }
  EXPECT_EQ(hash_of_type(""), 0U);
}

TEST_F(core_names, sends_each_peer_the_name_it_subscribed_by_out_of_one_slot) {
  auto& pair = advertise_pose(on);
  peer one{on}, other{on};
  one.say(R"({"op":"subscribe","topic":"/pose"})");
  other.say(R"({"op":"subscribe","topic":"pose"})");
  on.cycle();
  for (peer* p : {&one, &other}) on.net.link_of(p->id()).capacity_bytes = 0;
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  on.cycle();
  EXPECT_EQ(on.core.slots_in_use(), 2U);
  for (peer* p : {&one, &other}) on.net.link_of(p->id()).capacity_bytes = 4096;
  on.cycles(2);
  EXPECT_EQ(one.hear(), (texts{message(1), message(2)}));
  EXPECT_EQ(other.hear(), (texts{unslashed(1), unslashed(2)}));
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_names, continues_a_frame_without_the_slash_wherever_the_socket_stopped_taking_it) {
  auto& pair = advertise_pose(on);
  for (std::size_t bytes = 1; bytes < 80; ++bytes) {
    peer p = subscriber(on, "pose");
    ASSERT_TRUE(publish(on, pair, {1, 0}));
    ASSERT_TRUE(publish(on, pair, {2, 0}));
    EXPECT_EQ(read_slowly(on, p, bytes), (texts{unslashed(1), unslashed(2)})) << bytes;
    EXPECT_EQ(p.violated, "");
    p.leave();
    on.cycle();
  }
}

TEST_F(core_names, sends_a_frame_of_every_length_without_the_slash) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/t", 4096);
  peer p{on}, usual{on};
  p.say(R"({"op":"subscribe","topic":"t"})");
  usual.say(R"({"op":"subscribe","topic":"/t"})");
  on.cycle();
  // Around the lengths at which a frame's header grows, and beyond a small slot.
  for (const std::size_t bytes :
       {40U, 70U, 80U, 81U, 82U, 83U, 84U, 85U, 86U, 87U, 88U, 89U, 90U, 91U, 92U, 93U, 94U, 1100U, 4000U}) {
    const std::string body = R"({"a":")" + std::string(bytes, 'a') + R"("})";
    ASSERT_TRUE(publish_text(on, pair, body));
    on.cycles(2);
    EXPECT_EQ(p.hear(), texts{R"({"op":"publish","topic":"t","msg":)" + body + "}"}) << bytes;
    EXPECT_EQ(usual.hear(), texts{R"({"op":"publish","topic":"/t","msg":)" + body + "}"}) << bytes;
    EXPECT_EQ(p.violated, "");
  }
}

TEST_F(core_names, gives_a_peer_that_subscribed_by_both_names_one_copy_by_each) {
  auto& pair = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","id":"1","topic":"/pose"})");
  p.say(R"({"op":"subscribe","id":"2","topic":"pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  texts heard = p.hear_after(1);
  std::sort(heard.begin(), heard.end());
  EXPECT_EQ(heard, (texts{message(1), unslashed(1)}));
  p.tell(R"({"op":"unsubscribe","id":"1","topic":"/pose"})");
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  EXPECT_EQ(p.hear_after(1), texts{unslashed(2)});
  p.tell(R"({"op":"unsubscribe","topic":"pose"})");
  EXPECT_EQ(publish(on, pair, {3, 0}).code(), rowe::errc::no_peer);
}

TEST_F(core_names, unsubscribes_by_the_other_name_where_there_is_but_one) {
  auto& pair = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  p.say(R"({"op":"unsubscribe","topic":"pose"})");
  EXPECT_TRUE(p.hear_after(1).empty());
  EXPECT_EQ(publish(on, pair, {1, 0}).code(), rowe::errc::no_peer);
}

TEST_F(core_names, keeps_the_last_value_for_late_subscribers_by_either_name) {
  auto& pair = advertise_pose_now(on, {.latched = true});
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  peer late{on};
  EXPECT_EQ(late.ask(R"({"op":"subscribe","topic":"pose"})"), texts{unslashed(1)});
}

TEST_F(core_names, relays_between_peers_and_handles_by_either_name) {
  core_harness hub{hub_options()};
  auto& inbox = hub.offer(pair_kind::subscribe_text, "chatter", 100);
  hub.cycle();
  peer speaker{hub}, one{hub}, other{hub};
  one.say(R"({"op":"subscribe","topic":"/chatter"})");
  other.say(R"({"op":"subscribe","topic":"chatter"})");
  hub.cycle();
  for (const char* name : {"/chatter", "chatter"}) {
    speaker.tell(R"({"op":"publish","topic":")" + std::string{name} + R"(","msg":{"d":1}})");
    EXPECT_EQ(one.hear(), texts{R"({"op":"publish","topic":"/chatter","msg":{"d":1}})"});
    EXPECT_EQ(other.hear(), texts{R"({"op":"publish","topic":"chatter","msg":{"d":1}})"});
    EXPECT_EQ(take(inbox).value(), R"({"d":1})");
  }
  EXPECT_TRUE(hub.core.check());
}

TEST_F(core_names, takes_one_advertisement_for_both_names) {
  peer p{on};
  for (int i = 0; i < 5; ++i) { // more than one peer may advertise
    p.say(R"({"op":"advertise","topic":"/a","type":"test_msgs/msg/A"})");
    p.say(R"({"op":"advertise","topic":"a","type":"test_msgs/A"})");
  }
  p.say(R"({"op":"call_service","id":"1","service":"/rosapi/topic_type","args":{"topic":"a"}})");
  p.say(R"({"op":"call_service","id":"2","service":"rosapi/topic_type","args":{"topic":"/a"}})");
  EXPECT_EQ(
      p.hear_after(2),
      (texts{R"({"op":"service_response","id":"1","service":"/rosapi/topic_type","result":true,"values":)"
             R"({"type":"test_msgs/msg/A"}})",
             R"({"op":"service_response","id":"2","service":"rosapi/topic_type","result":true,"values":)"
             R"({"type":"test_msgs/msg/A"}})"}));
  EXPECT_EQ(p.ask(R"({"op":"advertise","topic":"a","type":"test_msgs/B"})"),
            texts{R"({"op":"status","level":"error","msg":"advertise: the topic exists with the type )"
                  R"(test_msgs/msg/A"})"});
  p.say(R"({"op":"unadvertise","topic":"a"})");
  p.say(R"({"op":"unadvertise","topic":"/a"})");
  EXPECT_EQ(p.hear_after(1).size(), 1U); // the second is refused: there was one
}

TEST_F(core_names, lets_a_handle_share_a_topic_whose_type_is_spelt_the_other_way) {
  peer p = peer_saying(on, R"({"op":"advertise","topic":"cmd_vel","type":"geometry_msgs/msg/Twist"})");
  auto& pair = on.offer_now(pair_kind::subscribe_value, "/cmd_vel", sizeof(rowe::ros::twist), {},
                            &rowe::describe<rowe::ros::twist>(), "geometry_msgs/Twist");
  EXPECT_EQ(pair.lifecycle.look(), pair_phase::active);
}

TEST_F(core_names, says_which_types_met_when_a_handle_is_refused) {
  on.offer_now(pair_kind::publish_text, "/cmd_vel", 100, {}, nullptr, "std_msgs/msg/String");
  while (on.shared.try_event()) continue;
  auto& pair = on.offer_now(pair_kind::subscribe_value, "cmd_vel", sizeof(rowe::ros::twist), {},
                            &rowe::describe<rowe::ros::twist>(), "geometry_msgs/Twist");
  EXPECT_EQ(pair.lifecycle.look(), pair_phase::refused);
  EXPECT_EQ(pair.lifecycle.refusal().code, rowe::errc::type_conflict);
  const auto told = on.shared.try_event();
  ASSERT_TRUE(told);
  EXPECT_EQ(std::string_view{told->what},
            "subscribe /cmd_vel: the topic has the type std_msgs/msg/String, not geometry_msgs/Twist");
}

TEST_F(core_names, tells_a_peer_that_expects_another_type_and_sends_it_the_messages_all_the_same) {
  auto& pair = advertise_pose_now(on);
  peer p = peer_saying(on, R"({"op":"subscribe","id":"s","topic":"pose","type":"std_msgs/String"})");
  EXPECT_EQ(p.hear(),
            texts{R"({"op":"status","level":"error","id":"s","msg":"subscribe /pose: the topic has the type )"
                  R"(test/Pose, not std_msgs/String"})"});
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  EXPECT_EQ(p.hear_after(1), texts{unslashed(1)});
}

TEST_F(core_names, tells_a_peer_that_subscribed_before_the_topic_had_its_type) {
  peer early{on}, right{on}, indifferent{on}, speaker{on};
  early.say(R"({"op":"subscribe","topic":"/pose","type":"std_msgs/String"})");
  right.say(R"({"op":"subscribe","topic":"/pose","type":"test/msg/Pose"})");
  indifferent.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  advertise_pose(on);
  on.cycles(2);
  EXPECT_EQ(
      early.hear(),
      texts{R"({"op":"status","level":"error","msg":"subscribe /pose: the topic has the type test/Pose, )"
            R"(not the one that was asked for"})"});
  EXPECT_TRUE(right.hear().empty());
  EXPECT_TRUE(indifferent.hear().empty());
  speaker.tell(R"({"op":"advertise","topic":"pose","type":"test/Pose"})");
  EXPECT_TRUE(early.hear().empty()); // once
}

TEST_F(core_names, gives_its_own_topics_by_either_name_and_keeps_peers_off_both) {
  peer p = subscriber(on, "rowe/stats");
  on.cycle(150ms);
  const std::string heard = only(p.hear());
  EXPECT_TRUE(heard.starts_with(R"({"op":"publish","topic":"rowe/stats","msg":{"name":)")) << heard;
  p.say(R"({"op":"unsubscribe","topic":"rowe/stats"})");
  p.say(R"({"op":"advertise","topic":"rowe/mine","type":"x"})");
  p.say(R"({"op":"publish","topic":"rowe/stats","msg":{}})");
  on.cycle();
  EXPECT_EQ(
      p.hear(),
      (texts{
          R"({"op":"status","level":"error","msg":"advertise: topics below /rowe/ are the endpoint's own"})",
          R"({"op":"status","level":"error","msg":"publish: topics below /rowe/ are the endpoint's own"})"}));
}

TEST_F(core_names, shows_the_stop_by_either_name) {
  on.offer_now(rowe::detail::latch_request({}));
  peer one{on}, other{on}, both{on};
  one.say(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  other.say(R"({"op":"subscribe","topic":"rowe/stop/state"})");
  both.say(R"({"op":"subscribe","topic":"rowe/stop/state"})");
  both.say(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  on.cycles(3);
  for (const auto& [to, begins] :
       {std::pair{&one, R"({"op":"publish","topic":"/rowe/stop/state","msg":{"state":)"},
        std::pair{&other, R"({"op":"publish","topic":"rowe/stop/state","msg":{"state":)"},
        std::pair{&both, R"({"op":"publish","topic":"/rowe/stop/state","msg":{"state":)"}}) {
    const texts heard = to->hear();
    ASSERT_FALSE(heard.empty());
    EXPECT_TRUE(heard.back().starts_with(begins)) << heard.back();
    EXPECT_TRUE(heard.back().ends_with("}}"));
    EXPECT_EQ(to->violated, "");
  }
}

TEST_F(core_names, takes_the_longest_name_without_its_slash) {
  const std::string name(small_options().limits.topic_bytes_max, 'n');
  peer p{on}, usual{on};
  p.say(R"({"op":"subscribe","topic":")" + name + R"("})");
  usual.say(R"({"op":"subscribe","topic":"/)" + name.substr(1) + R"("})"); // another topic
  EXPECT_TRUE(p.hear_after(1).empty());
  auto& pair = on.offer_now(pair_kind::publish_text, name, 100);
  ASSERT_TRUE(publish_text_now(on, pair, "{}"));
  EXPECT_EQ(p.hear(), texts{R"({"op":"publish","topic":")" + name + R"(","msg":{}})"});
  EXPECT_TRUE(usual.hear().empty());
}

TEST_F(core_names, keeps_two_slashes_apart_from_one) {
  auto& pair = on.offer_now(pair_kind::publish_text, "//t", 100);
  peer p{on}, other{on};
  p.say(R"({"op":"subscribe","topic":"//t"})");
  other.say(R"({"op":"subscribe","topic":"/t"})");
  on.cycle();
  ASSERT_TRUE(publish_text_now(on, pair, "{}"));
  EXPECT_EQ(p.hear(), texts{R"({"op":"publish","topic":"//t","msg":{}})"});
  EXPECT_TRUE(other.hear().empty());
}

struct core_names_as_client : core_test {
  core_names_as_client() : core_test{small_options(), side::client} { on.cycle(); }
  static void leave(rowe::detail::queue_pair& pair) { pair.lifecycle.close(); }
  static bool says(const std::string& text, std::string_view op, std::string_view topic) {
    return text.find(R"("op":")" + std::string{op} + '"') != text.npos &&
           text.find(R"("topic":")" + std::string{topic} + '"') != text.npos;
  }
};

TEST_F(core_names_as_client, calls_a_topic_towards_the_server_as_the_first_handle_does) {
  for (const bool connected_before : {false, true}) {
    std::optional<peer> server;
    if (connected_before) server.emplace(on, side::client);
    on.cycle();
    auto& first = on.offer(pair_kind::subscribe_text, "in", 100);
    auto& second = on.offer(pair_kind::subscribe_text, "/in", 100);
    auto& out = on.offer(pair_kind::publish_text, "out", 100);
    auto& also = on.offer(pair_kind::publish_text, "/out", 100);
    on.cycles(2);
    if (!connected_before) server.emplace(on, side::client);
    on.cycles(2);
    for (const std::string& text : server->hear())
      EXPECT_TRUE(says(text, "subscribe", "in") || says(text, "advertise", "out")) << text;
    for (rowe::detail::queue_pair* pair : {&out, &also}) {
      ASSERT_TRUE(publish_text_now(on, *pair, "{}"));
      EXPECT_EQ(server->hear(), texts{R"({"op":"publish","topic":"out","msg":{}})"});
    }
    server->tell(R"({"op":"publish","topic":"in","msg":{"d":1}})");
    EXPECT_EQ(take(first).value(), R"({"d":1})");
    EXPECT_EQ(take(second).value(), R"({"d":1})");
    leave(first);
    leave(out);
    EXPECT_TRUE(server->hear_after(3).empty()); // the others go on
    leave(second);
    leave(also);
    const texts last = server->hear_after(3);
    ASSERT_EQ(last.size(), 2U);
    EXPECT_TRUE(says(last[0], "unsubscribe", "in")) << last[0];
    EXPECT_TRUE(says(last[1], "unadvertise", "out")) << last[1];
    EXPECT_EQ(server->violated, "");
    server->leave();
    on.cycles(2);
  }
}

TEST_F(core_names_as_client, continues_a_masked_frame_without_the_slash_where_the_socket_stopped) {
  auto& pair = on.offer_now(pair_kind::publish_text, "out", 100);
  peer server{on, side::client};
  (void)server.hear_after(1);
  for (std::size_t bytes = 1; bytes < 60; ++bytes) {
    ASSERT_TRUE(publish_text(on, pair, R"({"n":12345})"));
    EXPECT_EQ(read_slowly(on, server, bytes, 80),
              texts{R"({"op":"publish","topic":"out","msg":{"n":12345}})"})
        << bytes;
    EXPECT_EQ(server.violated, "");
  }
}

} // namespace
} // namespace core_names_test
} // namespace harness
