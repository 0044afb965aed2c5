// SPDX-License-Identifier: Apache-2.0
// A third codec beside the two that there are (tests/wire/numbers_codec.hpp), of which the service knows
// nothing.
#include "core_fixtures.hpp"

#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include <algorithm>
#include <deque>

#include "service/graph/numbers_lists.hpp"

namespace core_numbers_codec_test {
namespace {

using namespace harness;
using numbers::four;
using numbers::gone_of;
using numbers::list_of;
using numbers::numbered;
using rowe::service::side;
using rowe::wire::opcode;

std::string message(std::uint32_t tag, rowe::rt::time_point at, std::string_view body) {
  const auto ns = static_cast<std::uint64_t>(rowe::rt::nanoseconds_of(at));
  return "m" + four(tag) + four(static_cast<std::uint32_t>(ns)) + four(static_cast<std::uint32_t>(ns >> 32)) +
         std::string{body};
}

std::string subscribe_to(std::uint32_t tag, std::uint32_t channel) {
  return R"({"want":[[)" + std::to_string(tag) + "," + std::to_string(channel) + "]]}";
}

// The greeting is read where it is made.
struct client : peer {
  explicit client(core_harness& in, std::string_view path = "/")
      : peer{in, side::server, "127.0.0.1:50000", path, numbers::subprotocol} {
    greeting = greeting_of(in, *this);
    topics = list_of(greeting, 'T');
    services = list_of(greeting, 'S');
  }
  texts greeting;
  numbered topics;
  numbered services;
};

struct core_numbers_codec : core_test {
  explicit core_numbers_codec(const rowe::endpoint_options& options = unguarded_hub_options())
      : core_test{options, side::server, &numbers::protocols()} {
    on.cycle();
  }

  // What it hears of what it says.
  texts say(peer& p, std::string_view text) { return p.ask(text, 2); }
  texts send(peer& p, const std::string& bytes) {
    p.send(opcode::binary, bytes);
    return p.hear_after(2);
  }
};

const std::string id = std::string{"\0\xff\"\\", 4}; // of a call: any four bytes

// ---- the server speaks first

TEST_F(core_numbers_codec, says_who_it_is_and_what_there_is_before_its_client_says_anything) {
  advertise_pose_now(on);
  client p{on};
  ASSERT_EQ(p.greeting.size(), 3U);
  EXPECT_EQ(p.greeting[0], "hrobot");
  EXPECT_EQ(p.greeting[1].front(), 'T');
  EXPECT_EQ(p.greeting[2].front(), 'S');
  EXPECT_EQ(p.binaries, 3) << "each a binary frame";
  EXPECT_TRUE(p.topics.contains("/pose"));
  EXPECT_TRUE(p.topics.contains("/rowe/stats"));
  EXPECT_FALSE(p.topics.contains("/rowe/stop/state")) << "there is nothing to stop";
  EXPECT_TRUE(p.services.contains("/rosapi/topics"));
  EXPECT_FALSE(p.services.contains("/rowe/stop"));
}

TEST_F(core_numbers_codec, tells_of_topics_that_come_and_go_by_numbers_that_are_not_given_again) {
  client p{on};
  EXPECT_FALSE(p.topics.contains("/a"));
  peer other = peer_saying(on, R"({"op":"advertise","topic":"/a"})", 2);
  const numbered came = list_of(p.hear(), 'T');
  ASSERT_TRUE(came.contains("/a"));
  other.say(R"({"op":"unadvertise","topic":"/a"})");
  other.say(R"({"op":"advertise","topic":"/b"})"); // in its place
  const texts heard = p.hear_after(2);
  EXPECT_EQ(gone_of(heard, 't'), std::vector{came.at("/a")});
  EXPECT_TRUE(heard.front().starts_with('t')) << "what is gone comes first";
  const numbered then = list_of(heard, 'T');
  ASSERT_TRUE(then.contains("/b"));
  EXPECT_NE(then.at("/b"), came.at("/a"));
  EXPECT_EQ(say(p, subscribe_to(1, came.at("/a"))),
            texts{"eno topic or service has the number " + std::to_string(came.at("/a"))});
}

TEST_F(core_numbers_codec, gives_a_topic_another_number_with_its_type) {
  peer other = subscriber(on, "/a");
  client p{on};
  ASSERT_TRUE(p.topics.contains("/a"));
  EXPECT_EQ(say(p, subscribe_to(7, p.topics.at("/a"))), texts{});
  other.say(R"({"op":"advertise","topic":"/a","type":"a/A"})");
  const texts heard = p.hear_after(2);
  EXPECT_EQ(gone_of(heard, 't'), std::vector{p.topics.at("/a")});
  EXPECT_TRUE(list_of(heard, 'T').contains("/a"));
  other.tell(R"({"op":"publish","topic":"/a","msg":{"v":1}})");
  EXPECT_EQ(p.hear(), texts{message(7, on.now, R"({"v":1})")}) << "its subscription stays";
}

TEST_F(core_numbers_codec, tells_of_services_that_come_and_go) {
  client p{on};
  peer other = peer_saying(on, R"({"op":"advertise_service","service":"/add","type":"a/Add"})", 2);
  const numbered came = list_of(p.hear(), 'S');
  ASSERT_TRUE(came.contains("/add"));
  other.leave();
  EXPECT_EQ(gone_of(p.hear_after(2), 's'), std::vector{came.at("/add")});
}

// A peer that advertises and takes it back all the time: others must not be closed because they do not read
// all of that.
TEST_F(core_numbers_codec, are_not_told_all_that_comes_and_goes_without_pause) {
  client p{on};
  peer restless{on};
  on.cycles(100);
  on.net.link_of(p.id()).capacity_bytes = 16; // it reads nothing, so its replies stay in their queue
  for (int i = 0; i < 500; ++i) {
    restless.tell(R"({"op":"advertise","topic":"/a"})");
    restless.tell(R"({"op":"unadvertise","topic":"/a"})");
  }
  EXPECT_FALSE(p.cut());
  on.net.link_of(p.id()).capacity_bytes = 4096;
  (void)p.hear_after(2000);
  for (const char* topic : {"/a", "/b", "/c", "/d"}) { // with pauses each is told at once, and some in a row
    restless.tell(std::string{R"({"op":"advertise","topic":")"} + topic + R"("})");
    EXPECT_TRUE(list_of(p.hear(), 'T').contains(topic));
  }
  restless.tell(R"({"op":"unadvertise","topic":"/a"})");
  EXPECT_EQ(p.hear(), texts{}) << "not yet";
  const auto until = on.now + 250ms;
  texts heard;
  for (int i = 0; i < 50 && heard.empty() && on.next_wake <= until; ++i) {
    on.cycle(on.next_wake - on.now);
    heard = p.hear();
  }
  EXPECT_EQ(heard.size(), 1U) << "it is gone";
}

// It asks for more than it reads, and so loses what waits longest: the greeting. It is told that again.
TEST_F(core_numbers_codec, is_greeted_again_when_it_has_lost_that) {
  peer p{on, side::server, "127.0.0.1:50000", "/", numbers::subprotocol};
  on.net.link_of(p.id()).capacity_bytes = 0;
  on.cycle();
  const std::string of_statistics = "c" + four(5);
  for (std::uint32_t i = 0; i < 8; ++i) p.send(opcode::binary, of_statistics + four(i) + "{}");
  on.cycles(4);
  EXPECT_GT(on.count(counter::outbox_full), 0U);
  EXPECT_FALSE(p.cut());
  on.net.link_of(p.id()).capacity_bytes = 1U << 20U;
  const texts heard = p.hear_after(100);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), "hrobot"), 1);
  EXPECT_TRUE(list_of(heard, 'T').contains("/rowe/stats"));
}

// ---- topics

TEST_F(core_numbers_codec, says_of_a_latched_value_when_it_was_published) {
  auto& pose_pair = advertise_pose_now(on, {.latched = true});
  const auto published = on.now;
  ASSERT_TRUE(publish(on, pose_pair, {3, 0}));
  on.cycles(100);
  client p{on};
  EXPECT_EQ(say(p, subscribe_to(7, p.topics.at("/pose"))), texts{message(7, published, R"({"x":3,"y":0})")});
}

TEST_F(core_numbers_codec, goes_on_with_a_message_that_the_socket_took_a_part_of) {
  auto& pose_pair = advertise_pose_now(on);
  client p{on};
  say(p, subscribe_to(0x01020304, p.topics.at("/pose")));
  for (std::size_t capacity = 1; capacity < 40; ++capacity) {
    on.net.link_of(p.id()).capacity_bytes = capacity;
    const auto published = on.now;
    ASSERT_TRUE(publish(on, pose_pair, {1, 0}));
    texts heard;
    for (int i = 0; i < 60 && heard.empty(); ++i) heard = p.hear_after(1);
    EXPECT_EQ(heard, texts{message(0x01020304, published, R"({"x":1,"y":0})")}) << capacity;
  }
}

TEST_F(core_numbers_codec, takes_several_requests_of_one_message) {
  auto& pose_pair = advertise_pose(on);
  on.offer_now(rowe::detail::pair_kind::publish_value, "/other", sizeof(pose), {}, &rowe::describe<pose>());
  client p{on};
  const std::string three = R"({"want":[[1,)" + std::to_string(p.topics.at("/pose")) + "],[2,9999],[3," +
                            std::to_string(p.topics.at("/other")) + "]]}";
  EXPECT_EQ(say(p, three), texts{"eno topic or service has the number 9999"});
  EXPECT_EQ(say(p, R"({"drop":[3,9]})"), texts{"eno topic or service has the number 9"});
  ASSERT_TRUE(publish(on, pose_pair, {1, 0}));
  EXPECT_EQ(p.hear_after(1).size(), 1U);
  EXPECT_EQ(say(p, R"({"drop":[1]})"), texts{});
  EXPECT_FALSE(publish(on, pose_pair, {1, 0})) << "nobody listens";
}

struct numbers_beyond_their_rate : core_numbers_codec {
  numbers_beyond_their_rate()
      : core_numbers_codec{with_limits(unguarded_hub_options(), &limits::messages_per_second_max, 10,
                                       &limits::subscriptions_per_connection_max, 64)} {}
};

// One after the other in one message.
std::string drop(std::size_t count) {
  std::string list;
  for (std::size_t i = 0; i < count; ++i) list += i == 0 ? "1" : ",1";
  return R"({"drop":[)" + list + "]}";
}

TEST_F(numbers_beyond_their_rate, are_counted_each_where_a_message_lists_several) {
  client p{on};
  EXPECT_EQ(say(p, drop(30)), texts(10, "eno topic or service has the number 1"));
  EXPECT_EQ(on.count(counter::over_rate), 20U);
  EXPECT_EQ(on.count(counter::messages_in), 1U);
  on.cycles(100); // one more
  EXPECT_EQ(say(p, drop(1)), texts{"eno topic or service has the number 1"});
  // Who goes on like this is closed as if each had come in a message of its own.
  for (int i = 0; i < 60 && p.close_code == 0; ++i) {
    say(p, drop(30));
    (void)p.hear_after(100);
  }
  EXPECT_EQ(p.close_code, 1008);
  EXPECT_EQ(on.count(counter::flooding_peers), 1U);
}

TEST_F(core_numbers_codec, carries_out_a_long_list_in_turn_with_others) {
  client p{on};
  client other{on};
  const auto asked = on.count(counter::messages_in);
  p.send(opcode::text, drop(1000));
  other.send(opcode::binary, "c" + four(4000) + "idxa{}");
  EXPECT_EQ(other.hear_after(1).size(), 1U) << "answered after a part of the list";
  const auto refused = [&] {
    return on.count(counter::refused_requests) + on.count(counter::refusals_unsaid);
  };
  EXPECT_LT(refused(), 1000U) << "one cycle does a stated amount of work";
  on.cycles(20);
  EXPECT_EQ(refused(), 1000U) << "all of it, in the end";
  EXPECT_EQ(on.count(counter::messages_in), asked + 2);
}

TEST_F(core_numbers_codec, answers_each_call_of_a_number_that_is_gone_however_many_are_refused) {
  client p{on};
  (void)say(p, drop(8));
  (void)say(p, drop(8));
  (void)say(p, drop(8)); // more than 20 refusals in a second
  ASSERT_GT(on.count(counter::refusals_unsaid), 0U);
  for (const char last : {'a', 'b', 'c'}) {
    const std::string its = "idx" + std::string(1, last);
    EXPECT_EQ(send(p, "c" + four(4000) + its + "{}"),
              texts{"f" + its + "no topic or service has the number 4000"});
  }
}

TEST_F(core_numbers_codec, keeps_one_number_for_a_subscription_and_for_a_channel_of_a_peer) {
  advertise_pose(on);
  on.offer_now(rowe::detail::pair_kind::publish_value, "/other", sizeof(pose), {}, &rowe::describe<pose>());
  client p{on};
  const std::uint32_t pose_channel = p.topics.at("/pose");
  EXPECT_EQ(say(p, subscribe_to(1, pose_channel)), texts{});
  EXPECT_EQ(say(p, subscribe_to(1, pose_channel)), texts{}) << "the same once more";
  EXPECT_EQ(say(p, subscribe_to(2, pose_channel)),
            texts{"esubscribe: this peer subscribes to the topic already, by another number"});
  EXPECT_EQ(say(p, subscribe_to(1, p.topics.at("/other"))),
            texts{"esubscribe: this peer has another topic with the number 1"});
  client second{on};
  EXPECT_EQ(say(second, subscribe_to(1, second.topics.at("/other"))), texts{}) << "another peer's own";

  constexpr std::string_view refusal =
      "eoffer: this peer has this topic by another number, or another topic by this one";
  const auto errors_of = [](const texts& heard) {
    texts errors;
    std::copy_if(heard.begin(), heard.end(), std::back_inserter(errors),
                 [](const std::string& one) { return one.starts_with('e'); });
    return errors;
  };
  EXPECT_EQ(errors_of(say(p, R"({"offer":[[5,"/a"],[5,"/a"]]})")), texts{});
  EXPECT_EQ(errors_of(say(p, R"({"offer":[[6,"/a"],[5,"/b"]]})")),
            (texts{std::string{refusal}, std::string{refusal}}));
}

// ---- calls

TEST_F(core_numbers_codec, answers_calls_of_the_endpoints_services_of_handles_and_of_peers) {
  auto echo = on.open<rowe::responder<pose, pose>>(echo_request());
  peer other = peer_saying(on, R"({"op":"advertise_service","service":"/add"})");
  client p{on};
  const auto greeting = p.binaries;
  EXPECT_EQ(send(p, "c" + four(p.services.at("/rosapi/topic_type")) + id + R"({"topic":"/no"})"),
            texts{"r" + id + R"({"type":""})"});

  EXPECT_EQ(send(p, "c" + four(p.services.at("/echo")) + id + R"({"x":1,"y":2})"), texts{});
  auto asked = echo.try_next(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(echo.reply(*asked, {asked->value().y, asked->value().x}, on.now));
  on.cycle();
  EXPECT_EQ(p.hear(), texts{"r" + id + R"({"x":2,"y":1})"});

  EXPECT_EQ(send(p, "c" + four(p.services.at("/add")) + id + R"({"a":1})"), texts{});
  const std::string called = only(other.hear());
  const auto call_id = rowe::json::find(rowe::json::root(called).raw, "id");
  ASSERT_TRUE(call_id);
  other.tell(R"({"op":"service_response","service":"/add","result":true,"values":{"sum":3},"id":)" +
             std::string{call_id->raw} + "}");
  EXPECT_EQ(p.hear(), texts{"r" + id + R"({"sum":3})"});
  EXPECT_EQ(p.binaries, greeting + 3);
}

TEST_F(core_numbers_codec, answers_every_call_that_fails_under_its_id) {
  on.offer_now(echo_request());
  client p{on};
  const std::string of_echo = "c" + four(p.services.at("/echo")) + id;
  EXPECT_EQ(send(p, "c" + four(4000) + id + "{}"),
            texts{"f" + id + "no topic or service has the number 4000"});
  EXPECT_EQ(send(p, of_echo + "[1]"), texts{"f" + id + "the body must be a JSON object"});
  const std::string torn = only(send(p, of_echo + "{"));
  EXPECT_TRUE(torn.starts_with("f" + id)) << torn;
  EXPECT_EQ(on.count(counter::malformed), 2U);
  EXPECT_EQ(send(p, of_echo + R"({"x":1,"y":2})"), texts{});
  EXPECT_EQ(send(p, of_echo + R"({"x":1,"y":2})"),
            texts{"f" + id + "a call with this id is not answered yet"});
  EXPECT_FALSE(p.cut());
}

// ---- what is refused

TEST_F(core_numbers_codec, refuses_what_nobody_understands_with_a_diagnostic) {
  client p{on};
  say(p, R"({"offer":[[5,"/cmd"]]})");
  for (const std::string& bytes : {std::string{}, std::string{"q"}, std::string{"p"}, "p" + four(5),
                                   "c" + four(1) + "abc", std::string{"x"}})
    EXPECT_EQ(send(p, bytes), texts{"enobody understands this"}) << bytes;
  for (const char* text : {"{}", "[1]", R"({"want":1})", R"({"want":[]})", R"({"want":[7]})",
                           R"({"want":[[1]]})", R"({"want":[[-1,1]]})", R"({"want":[[1,4294967295]]})",
                           R"({"offer":[[1,""]]})", R"({"offer":[[1,7]]})"})
    EXPECT_EQ(say(p, text), texts{"enobody understands this"}) << text;
  EXPECT_EQ(say(p, "{").size(), 1U);
  EXPECT_EQ(send(p, "p" + four(5) + "[1]"), texts{"ethe body must be a JSON object"});
  EXPECT_EQ(send(p, "p" + four(5) + "{").size(), 1U);
  EXPECT_FALSE(p.cut());
}

// ---- the stop

struct numbers_and_a_latch : core_numbers_codec {
  numbers_and_a_latch() {
    on.offer(rowe::detail::latch_request({.name = "loop"}));
    on.cycles(2);
  }
  static bool has(const texts& heard, const std::string& with) {
    return std::any_of(heard.begin(), heard.end(),
                       [&](const std::string& one) { return one.starts_with(with); });
  }
};

TEST_F(numbers_and_a_latch, stops_by_a_number_that_never_changes_and_shows_the_state) {
  client p{on};
  ASSERT_TRUE(p.services.contains("/rowe/stop"));
  EXPECT_EQ(p.services.at("/rowe/stop"), 1U);
  say(p, subscribe_to(9, p.topics.at("/rowe/stop/state")));
  const int before = p.binaries;
  p.send(opcode::binary, "c" + four(1) + "abcd" + R"({"source":"test"})");
  on.cycles(200);
  EXPECT_EQ(on.count(counter::stops), 1U);
  const texts heard = p.hear();
  EXPECT_TRUE(has(heard, R"(rabcd{"state":"stopped")"));
  EXPECT_TRUE(has(heard, "m" + four(9)));
  EXPECT_EQ(p.binaries, before + static_cast<int>(heard.size()));
}

TEST_F(numbers_and_a_latch, stops_whatever_else_is_wrong_with_the_call) {
  client p{on};
  std::uint64_t stops = 0;
  for (const char* body : {"", "{", "[1]", R"({"source":7})"}) {
    p.send(opcode::binary, "c" + four(1) + "abcd" + body);
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), ++stops) << body;
  }
}

TEST_F(numbers_and_a_latch, stops_before_what_the_peer_said_first) {
  advertise_pose_now(on);
  client p{on};
  peer other{on};
  other.say(R"({"op":"subscribe","topic":"/cmd"})");
  say(p, R"({"offer":[[5,"/cmd"]]})");
  for (int i = 0; i < 150; ++i) p.send(opcode::binary, "p" + four(5) + R"({"v":1})");
  p.send(opcode::binary, "c" + four(1) + "abcd{}");
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
  EXPECT_LT(on.count(counter::messages_in), 150U) << "most of the others wait";
}

TEST_F(numbers_and_a_latch, stops_on_the_path_of_the_stop_and_does_nothing_else_there) {
  client p{on, rowe::service::stop_path};
  EXPECT_EQ(p.greeting, texts{});
  EXPECT_EQ(say(p, R"({"offer":[[5,"/cmd"]]})"),
            texts{"e" + std::string{rowe::service::stop_only_diagnostic}});
  send(p, "c" + four(1) + "abcd{}");
  EXPECT_EQ(on.count(counter::stops), 1U);
}

// ---- next to the others

TEST_F(core_numbers_codec, leaves_the_other_codecs_as_they_are) {
  auto& pose_pair = advertise_pose(on, {.shared = true});
  auto echo = on.open<rowe::responder<pose, pose>>(echo_request());
  client p{on};
  peer page{on};
  peer program{on};
  EXPECT_EQ(page.hear_after(1), texts{}) << "nobody greets it";
  page.say(R"({"op":"subscribe","topic":"/pose"})");
  page.say(R"({"op":"subscribe","topic":"/cmd"})");
  say(p, subscribe_to(1, p.topics.at("/pose")));
  say(p, R"({"offer":[[5,"/cmd"]]})");
  ASSERT_TRUE(publish(on, pose_pair, {3, 0}));
  p.send(opcode::binary, "p" + four(5) + R"({"v":1})");
  program.say(R"({"service":"/echo","message_id":1,"x":1,"y":2})");
  on.cycle();
  EXPECT_EQ(page.hear(), (texts{R"({"op":"publish","topic":"/cmd","msg":{"v":1}})", harness::message(3)}));
  auto asked = echo.try_next(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(echo.reply(*asked, {5, 6}, on.now));
  EXPECT_EQ(program.hear_after(1), texts{R"({"x":5,"y":6,"in_reply_to":1})"});
  page.tell(R"({"op":"publish","topic":"/pose","msg":{"x":4,"y":0}})");
  EXPECT_EQ(p.hear().size(), 2U);
  send(program, "c" + four(1) + "abcd{}");
  EXPECT_EQ(program.close_code, 1003) << "no binary messages there";
  EXPECT_EQ(page.binaries + program.binaries, 0);
}

TEST_F(core_numbers_codec, parks_a_plain_message_for_which_there_is_no_room) {
  rowe::lane inbox{core_harness::handle_of(on.offer(lane_request(4, 64)))};
  on.cycle();
  client p{on};
  for (int i = 0; i < 20; ++i) p.send(opcode::binary, R"(x{"i":)" + std::to_string(i) + "}");
  std::vector<std::string> heard;
  for (int i = 0; i < 40; ++i) {
    on.cycle();
    if (const auto one = inbox.try_receive(on.now)) heard.emplace_back(one->value());
  }
  ASSERT_EQ(heard.size(), 20U);
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(heard[static_cast<std::size_t>(i)], R"({"i":)" + std::to_string(i) + "}");
}

TEST_F(core_numbers_codec, is_named_by_the_statistics) {
  client p{on};
  const std::string heard = only(send(p, "c" + four(p.services.at("/rowe/stats")) + "abcd{}"));
  EXPECT_TRUE(has(heard, R"("dialect":"numbers")"));
}

} // namespace
} // namespace core_numbers_codec_test
