// SPDX-License-Identifier: Apache-2.0
// Clients that speak Foxglove's protocol, beside those that speak rosbridge.
#include "core_fixtures.hpp"

#include <rowe/responder.hpp>

#include <algorithm>
#include <optional>

#include "json/reading/reader.hpp"

namespace core_foxglove_test {
namespace {

using namespace harness;
using rowe::service::side;
using rowe::wire::opcode;

std::string call_of(std::uint32_t service, std::uint32_t call, std::string_view body) {
  return "\x02" + four(service) + four(call) + four(4) + "json" + std::string{body};
}
std::string publish_of(std::uint32_t channel, std::string_view body) {
  return "\x01" + four(channel) + std::string{body};
}

// The number in front of a name in lists that were heard; none: it was not listed.
std::optional<std::uint32_t> number_of(const texts& heard, std::string_view op, std::string_view name_member,
                                       std::string_view name) {
  std::optional<std::uint32_t> found;
  for (const std::string& one : heard) {
    if (!one.starts_with(R"({"op":")" + std::string{op} + "\"")) continue;
    const std::size_t at = one.find(",\"" + std::string{name_member} + R"(":")" + std::string{name} + "\"");
    if (at == std::string::npos) continue;
    const std::size_t id = one.rfind(R"({"id":)", at);
    found = static_cast<std::uint32_t>(std::stoul(one.substr(id + 6)));
  }
  return found;
}

struct client : peer {
  explicit client(core_harness& in, std::string_view subprotocol = "foxglove.websocket.v1")
      : peer{in, side::server, "127.0.0.1:50000", "/", subprotocol} {
    greeting = greeting_of(in, *this);
  }
  std::uint32_t topic(std::string_view name) const {
    const auto number = number_of(greeting, "advertise", "topic", name);
    EXPECT_TRUE(number) << name;
    return number.value_or(0);
  }
  std::uint32_t service(std::string_view name) const {
    const auto number = number_of(greeting, "advertiseServices", "name", name);
    EXPECT_TRUE(number) << name;
    return number.value_or(0);
  }
  texts greeting;
};

struct core_foxglove : core_test {
  core_foxglove() : core_test{unguarded_hub_options()} { on.cycle(); }

  texts say(peer& p, std::string_view text) { return p.ask(text, 2); }
  texts send(peer& p, const std::string& bytes) {
    p.send(opcode::binary, bytes);
    return p.hear_after(2);
  }
};

std::string subscribe_to(std::uint32_t id, std::uint32_t channel) {
  return R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(id) + R"(,"channelId":)" +
         std::to_string(channel) + "}]}";
}

TEST_F(core_foxglove, is_told_who_we_are_and_what_there_is) {
  advertise_pose_now(on);
  for (const std::string_view name : {"foxglove.websocket.v1", "foxglove.sdk.v1"}) {
    client p{on, name};
    ASSERT_GE(p.greeting.size(), 3U);
    EXPECT_TRUE(p.greeting[0].starts_with(R"({"op":"serverInfo","name":"robot")")) << p.greeting[0];
    EXPECT_TRUE(has(p.greeting, R"("topic":"/pose","encoding":"json","schemaName":"test/Pose",)"
                                R"("schemaEncoding":"jsonschema","schema":"{\"title\":\"test/Pose\",)"));
    (void)p.topic("/pose");
    (void)p.service("/rosapi/topics");
    EXPECT_EQ(p.binaries, 0);
    for (const std::string& one : p.greeting) EXPECT_LE(one.size(), on.options.limits.message_bytes_max);
  }
}

TEST_F(core_foxglove, is_told_what_the_endpoints_own_topics_and_services_look_like) {
  client p{on};
  EXPECT_TRUE(has(p.greeting, R"("topic":"/rowe/stats","encoding":"json","schemaName":"rowe/Stats",)"
                              R"("schemaEncoding":"jsonschema","schema":"{\"title\":\"rowe/Stats\",)"));
  EXPECT_TRUE(
      has(p.greeting, R"(\"losses\":{\"type\":\"object\",\"properties\":{\"full\":{\"type\":\"integer\"},)"));
  EXPECT_TRUE(
      has(p.greeting, R"("name":"/rosapi/topics","type":"rosapi/Topics","request":{"encoding":"json",)"));
  EXPECT_TRUE(has(p.greeting, R"("schema":"{\"type\":\"object\",\"properties\":{)"
                              R"(\"topics\":{\"type\":\"array\",\"items\":{\"type\":\"string\"}},)"));
}

TEST_F(core_foxglove, is_told_of_a_topic_anew_when_its_schema_comes) {
  peer other = peer_saying(on, R"({"op":"subscribe","topic":"/pose","type":"test/Pose"})");
  client p{on};
  const std::uint32_t before = p.topic("/pose");
  advertise_pose(on);
  const texts heard = p.hear_after(2);
  EXPECT_TRUE(has(heard, R"({"op":"unadvertise","channelIds":[)" + std::to_string(before) + "]}"));
  const auto after = number_of(heard, "advertise", "topic", "/pose");
  ASSERT_TRUE(after);
  EXPECT_NE(*after, before);
  EXPECT_TRUE(has(heard, R"(\"title\":\"test/Pose\")"));
}

TEST_F(core_foxglove, gets_messages_behind_its_own_number_and_the_wall_clocks_time) {
  auto& pose_pair = advertise_pose_now(on);
  client p{on};
  EXPECT_EQ(say(p, subscribe_to(7, p.topic("/pose"))), texts{});
  const auto ns = static_cast<std::uint64_t>(rowe::rt::nanoseconds_of(on.now)); // the offset is 0 here
  ASSERT_TRUE(publish(on, pose_pair, {3, 0}));
  on.cycle(5ms);
  EXPECT_EQ(p.hear(), texts{"\x01" + four(7) + four(static_cast<std::uint32_t>(ns)) +
                            four(static_cast<std::uint32_t>(ns >> 32)) + R"({"x":3,"y":0})"});
  EXPECT_EQ(p.binaries, 1);
  EXPECT_EQ(say(p, R"({"op":"unsubscribe","subscriptionIds":[7]})"), texts{});
  EXPECT_FALSE(publish(on, pose_pair, {3, 0})) << "nobody listens";
}

TEST_F(core_foxglove, is_told_the_time_by_which_messages_are_stamped) {
  auto& pose_pair = advertise_pose_now(on);
  client one{on};
  client idle{on};
  one.tell(R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":)" + std::to_string(one.topic("/pose")) +
               "}]}",
           2);
  (void)one.hear();
  (void)idle.hear();
  one.times.clear();
  idle.times.clear();
  for (int i = 0; i < 1000; ++i) {
    on.cycle(std::chrono::milliseconds{1});
    (void)one.hear();
    (void)idle.hear();
  }
  EXPECT_NEAR(static_cast<double>(one.times.size()), 60, 8);
  EXPECT_NEAR(static_cast<double>(idle.times.size()), 4, 1);
  ASSERT_TRUE(publish(on, pose_pair, {1, 2}));
  const std::string heard = only(one.hear_after(1));
  std::int64_t stamp = 0;
  std::memcpy(&stamp, heard.data() + 5, sizeof stamp);
  EXPECT_GE(stamp, one.times.back()) << "it is the same clock";
  EXPECT_LT(stamp - one.times.back(), 20'000'000);
  on.net.link_of(one.id()).capacity_bytes = 0;
  for (int i = 0; i < 1000; ++i) on.cycle(std::chrono::milliseconds{1});
  EXPECT_LE(on.core.slots_in_use(), 2U) << "who does not read is not told ever more";
  one.leave();
  idle.leave();
  on.cycles(2);
  on.cycle(std::chrono::seconds{1});
  client again{on};
  on.cycle(std::chrono::milliseconds{300});
  (void)again.hear_after(1);
  EXPECT_FALSE(again.times.empty());
}

TEST_F(core_foxglove, publishes_to_those_who_speak_rosbridge) {
  client p{on};
  peer other{on};
  other.say(R"({"op":"subscribe","topic":"/cmd"})");
  EXPECT_FALSE(
      has(say(p, R"({"op":"advertise","channels":[{"id":5,"topic":"/cmd","encoding":"json"}]})"), "status"));
  send(p, publish_of(5, R"({"v":1})"));
  EXPECT_EQ(other.hear(), texts{R"({"op":"publish","topic":"/cmd","msg":{"v":1}})"});
  EXPECT_TRUE(has(send(p, publish_of(6, R"({"v":1})")), R"({"op":"status","level":2,"message":")"));
  EXPECT_FALSE(has(say(p, R"({"op":"unadvertise","channelIds":[5]})"), "status"));
  EXPECT_TRUE(has(send(p, publish_of(5, R"({"v":1})")), R"({"op":"status","level":2)"));
  EXPECT_FALSE(p.cut());
}

TEST_F(core_foxglove, calls_services_and_is_always_answered) {
  auto echo = on.open<rowe::responder<pose, pose>>(echo_request());
  client p{on};
  const std::uint32_t number = p.service("/echo");
  EXPECT_EQ(send(p, call_of(number, 9, R"({"x":1,"y":2})")), texts{});
  auto asked = echo.try_next(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(echo.reply(*asked, {asked->value().y, asked->value().x}, on.now));
  EXPECT_EQ(p.hear_after(1), texts{"\x03" + four(number) + four(9) + four(4) + R"(json{"x":2,"y":1})"});
  const auto fails = [&](const std::string& bytes, std::uint32_t service, std::uint32_t call) {
    const texts heard = send(p, bytes);
    EXPECT_TRUE(has(heard, R"({"op":"serviceCallFailure","serviceId":)" + std::to_string(service) +
                               R"(,"callId":)" + std::to_string(call) + R"(,"message":")"))
        << (heard.empty() ? "nothing" : heard[0]);
  };
  fails(call_of(4000, 10, "{}"), 4000, 10);
  fails(call_of(number, 11, "{"), number, 11);
  fails(call_of(number, 12, R"({"x":"no"})"), number, 12);
  fails(call_of(number, 13, "{}").substr(0, 11), number, 13);
  EXPECT_FALSE(p.cut());
}

TEST_F(core_foxglove, stops_at_once_by_a_number_that_never_changes) {
  on.offer(rowe::detail::latch_request({.name = "loop"}));
  on.cycles(2);
  client p{on};
  EXPECT_EQ(p.service("/rowe/stop"), 1U);
  say(p, subscribe_to(9, p.topic("/rowe/stop/state")));
  std::uint64_t stops = 0;
  for (const char* body : {"{}", "", "{", "[1]", R"({"source":7})"}) {
    p.send(opcode::binary, call_of(1, 3, body));
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), ++stops) << body;
  }
  const texts heard = p.hear_after(200);
  EXPECT_TRUE(has(heard, "\x03" + four(1) + four(3) + four(4) + R"(json{"state":"stopped")"));
  EXPECT_TRUE(has(heard, "\x01" + four(9))) << "the state, as a message of its topic";
  for (const std::size_t bytes : {5U, 8U, 9U, 12U, 15U}) { // what its number names is enough
    p.send(opcode::binary, call_of(1, 3, "{}").substr(0, bytes));
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), ++stops) << bytes;
    on.cycles(200);
    for (const std::string& told : p.hear()) {
      EXPECT_TRUE(told[0] != 3 || has(texts{told}, "\x03" + four(1) + four(3) + four(4) + "json{")) << bytes;
    }
  }
  p.send(opcode::binary, call_of(1, 3, "{}").substr(0, 4));
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), stops) << "a number is four bytes";
}

TEST_F(core_foxglove, is_told_what_is_not_offered_and_stays) {
  client p{on};
  for (const char* text : {R"({"op":"subscribeGraph"})", R"({"op":"fetchAsset","uri":"a","requestId":1})",
                           "{}", "[1]", "{", R"({"op":"publish","topic":"/rowe/stop","msg":{}})"})
    EXPECT_TRUE(has(say(p, text), R"({"op":"status","level":2,"message":")")) << text;
  EXPECT_TRUE(has(send(p, "\x07"), R"({"op":"status","level":2,"message":")"));
  EXPECT_FALSE(p.cut());
}

TEST_F(core_foxglove, lists_schemas_that_do_not_fit_into_one_message_in_several) {
  for (int i = 0; i < 6; ++i)
    on.offer(rowe::detail::pair_kind::publish_value, "/pose" + std::to_string(i), sizeof(pose), {},
             &rowe::describe<pose>(), "test/Pose");
  on.cycle();
  client p{on};
  for (int i = 0; i < 6; ++i) (void)p.topic("/pose" + std::to_string(i));
  EXPECT_FALSE(p.cut());
}

} // namespace
} // namespace core_foxglove_test
