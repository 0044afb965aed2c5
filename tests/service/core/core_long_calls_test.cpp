// SPDX-License-Identifier: Apache-2.0
// The core with calls whose arguments or answers are longer than message_bytes_max: what reaches whom, by
// each codec, and what becomes of a call whose long part finds no room, or comes late.
#include "long_fixtures.hpp"

#include "service/base/stand_in.hpp"

namespace harness {
namespace core_long_calls_test {
namespace {

using namespace long_fixtures;
using rowe::service::counter;
using rowe::service::side;

// What stands behind `name`, as it stands there.
std::string member(const std::string& text, std::string_view name) {
  const std::size_t at = text.find(name);
  if (at == std::string::npos) return {};
  const std::size_t from = at + name.size();
  return text.substr(from, text.find_first_of(",}", from) - from);
}

struct long_calls_test : core_test {
  explicit long_calls_test(std::uint32_t slots = 8) : core_test{options_with(64 * 1024, slots)} {}
  peer provider_of_maps() {
    return peer_saying(on, R"({"op":"advertise_service","service":"/map","type":"nav_msgs/GetMap"})");
  }
  void answer(peer& provider, const std::string& asked, std::string_view values) {
    provider.say(R"({"op":"service_response","result":true,"id":)" + member(asked, R"("id":)") +
                 R"(,"service":"/map","values":)" + std::string{values} + "}");
  }
  void TearDown() override { EXPECT_EQ(on.count(counter::violations), 0U); }
};

TEST_F(long_calls_test, go_from_peer_to_peer_with_their_answers) {
  peer provider = provider_of_maps();
  peer caller{on};
  const std::string args = map_of(40'000);
  const std::string values = map_of(50'000, 2);
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","args":)" + args + "}");
  const std::string asked = only(provider.hear_during(100));
  EXPECT_TRUE(asked.starts_with(R"({"op":"call_service",)")) << asked.substr(0, 100);
  EXPECT_TRUE(has(asked, R"("args":)" + args));
  answer(provider, asked, values);
  EXPECT_TRUE(only(caller.hear_during(100)) ==
              R"({"op":"service_response","id":"c1","service":"/map","result":true,"values":)" + values +
                  "}");
  EXPECT_TRUE(provider.hear_during(100).empty());
  // The call is over, and its id is free again.
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","args":{"x":1}})");
  answer(provider, only(provider.hear_during(100)), R"({"y":2})");
  EXPECT_TRUE(has(only(caller.hear_during(100)), R"("values":{"y":2})"));
  EXPECT_EQ(on.count(counter::replies_unsent) + on.count(counter::replies_late), 0U);
}

TEST_F(long_calls_test, go_between_all_codecs) {
  peer provider = provider_of_maps();
  const std::string values = map_of(30'000, 2);

  peer plain{on, side::server, "127.0.0.1:2", "/", "rowe.v1"};
  plain.say(R"({"service":"/map","image":")" + std::string(30'000, 'x') + R"(","message_id":7})");
  std::string asked = only(provider.hear_during(100));
  EXPECT_TRUE(has(asked, R"("args":{"image":")" + std::string(30'000, 'x') + "\"}")) << asked.substr(0, 200);
  answer(provider, asked, values);
  EXPECT_TRUE(only(plain.hear_during(100)) == R"({"result":)" + values + R"(,"in_reply_to":7})");

  peer fox{on, side::server, "127.0.0.1:2", "/", "foxglove.websocket.v1"};
  const texts lists = fox.hear_during(100);
  std::string all;
  for (const std::string& one : lists) all += one;
  const std::size_t map = all.find(R"("name":"/map")");
  ASSERT_NE(map, std::string::npos) << all;
  const std::size_t number = all.rfind(R"("id":)", map);
  const std::string id = four(static_cast<std::uint32_t>(std::stoul(all.substr(number + 5))));
  const std::string args = map_of(20'000, 3);
  fox.send(rowe::wire::opcode::binary, "\x02" + id + four(10) + four(4) + "json" + args);
  asked = only(provider.hear_during(100));
  EXPECT_TRUE(has(asked, R"("args":)" + args)) << asked.substr(0, 200);
  answer(provider, asked, values);
  EXPECT_TRUE(only(fox.hear_during(100)) == "\x03" + id + four(10) + four(4) + "json" + values);
  EXPECT_EQ(provider.violated + plain.violated + fox.violated, "");
}

TEST_F(long_calls_test, go_to_programs_that_speak_plain_messages) {
  peer provider{on, side::server, "127.0.0.1:2", "/", "rowe.v1"};
  provider.say(R"({"op":"advertise_service","service":"/map"})"); // peers of the plain format do so, too
  peer caller{on};
  (void)provider.hear_after(1);
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","args":{"data":")" +
             std::string(20'000, 'x') + R"("}})");
  const std::string asked = only(provider.hear_during(100));
  EXPECT_TRUE(has(asked, R"("data":")" + std::string(20'000, 'x') + "\"")) << asked.substr(0, 200);
}

TEST_F(long_calls_test, go_in_fragments_to_who_asked_for_them) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","fragment_size":8000})");
  answer(provider, only(provider.hear_during(100)), map_of(30'000));
  const texts heard = caller.hear_during(100);
  EXPECT_GT(heard.size(), 3U);
  for (const std::string& one : heard)
    EXPECT_TRUE(one.starts_with(R"({"op":"fragment")")) << one.substr(0, 80);
}

TEST_F(long_calls_test, fail_where_only_short_ones_are_taken) {
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/nobody","args":)" + map_of(20'000) + "}");
  std::string heard = only(caller.hear_during(100));
  EXPECT_TRUE(has(heard, R"("id":"c1")") && has(heard, R"("result":false)") && has(heard, "/nobody"));
  caller.say(R"({"op":"call_service","id":"c2","service":"/rosapi/topics","args":)" + map_of(20'000) + "}");
  heard = only(caller.hear_during(100));
  EXPECT_TRUE(has(heard, R"("id":"c2")") && has(heard, R"("result":false)") && has(heard, "20"));
  EXPECT_EQ(on.count(counter::too_big), 1U);
}

TEST_F(long_calls_test, of_a_mark_that_is_no_stand_in_are_refused) {
  peer provider = provider_of_maps();
  peer caller{on};
  const std::string id = R"("<a long value>")";
  caller.say(R"({"op":"call_service","id":)" + id + R"(,"service":"/map"})");
  answer(provider, only(provider.hear_during(100)), map_of(20'000));
  const std::string heard = only(caller.hear_during(100));
  EXPECT_TRUE(has(heard, R"("result":false)"));
  EXPECT_EQ(on.count(counter::too_big), 1U);
}

TEST_F(long_calls_test, whose_id_is_what_is_long_are_refused) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":")" + std::string(20'000, 'x') +
             R"(","service":"/map","args":{}})");
  EXPECT_TRUE(has(only(caller.hear_during(100)), "message_bytes_max"));
  EXPECT_TRUE(provider.hear_during(100).empty());
}

TEST_F(long_calls_test, wait_for_an_answer_that_began_in_time) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","timeout":2})");
  const std::string asked = only(provider.hear_during(100));
  const std::string said = R"({"op":"service_response","result":true,"id":)" + member(asked, R"("id":)") +
                           R"(,"service":"/map","values":)" + map_of(60'000) + "}";
  const auto frame = begun(said, said.size());
  texts heard;
  for (std::size_t at = 0; at < frame.size(); at += 4'000) { // some 4 s
    provider.send_raw({frame.begin() + static_cast<std::ptrdiff_t>(at),
                       frame.begin() + static_cast<std::ptrdiff_t>(std::min(frame.size(), at + 4'000))});
    for (int i = 0; i < 3; ++i) {
      on.cycle(80ms);
      (void)provider.hear();
      for (std::string& one : caller.hear()) heard.push_back(std::move(one));
    }
  }
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_TRUE(has(heard[0], R"("result":true)")) << heard[0].substr(0, 200);
  EXPECT_EQ(on.count(counter::calls_timed_out), 0U);
}

TEST_F(long_calls_test, end_when_their_time_is_over_and_nothing_comes) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map","timeout":2,"args":)" + map_of(20'000) + "}");
  const std::string asked = only(provider.hear_during(100));
  EXPECT_TRUE(has(only(caller.hear_during(30, 100ms)), "in time"));
  answer(provider, asked, map_of(20'000));
  EXPECT_TRUE(caller.hear_during(100).empty());
  EXPECT_EQ(on.count(counter::replies_late), 1U);
}

TEST_F(long_calls_test, of_one_that_leaves_are_forgotten) {
  peer provider = provider_of_maps();
  for (int i = 0; i < 20; ++i) {
    peer caller{on};
    caller.say(R"({"op":"call_service","id":"c1","service":"/map","args":)" + map_of(30'000) + "}");
    const std::string asked = only(provider.hear_during(100));
    on.net.link_of(caller.id()).capacity_bytes = 1000;
    answer(provider, asked, map_of(30'000));
    on.cycles(10);
    caller.leave();
    on.cycles(3);
    EXPECT_EQ(on.core.inconsistency(), "");
  }
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map"})");
  answer(provider, only(provider.hear_during(100)), map_of(30'000));
  EXPECT_TRUE(has(only(caller.hear_during(100)), R"("result":true)"));
}

TEST_F(long_calls_test, whose_provider_leaves_have_their_answer_all_the_same) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map"})");
  const std::string asked = only(provider.hear_during(100));
  on.net.link_of(caller.id()).capacity_bytes = 1000;
  answer(provider, asked, map_of(30'000));
  on.cycles(20);
  provider.leave();
  on.cycles(3);
  const std::string heard = only(caller.hear_during(200));
  EXPECT_TRUE(has(heard, R"("result":true)")) << heard.substr(0, 200);
}

// Nobody has looked for such names in what is long, so it stands by itself.
TEST_F(long_calls_test, with_names_of_the_endpoint_cannot_be_taken_for_another_message) {
  peer provider = provider_of_maps();
  peer plain{on, side::server, "127.0.0.1:2", "/", "rowe.v1"};
  const std::string spaces(20'000, ' ');
  for (const std::string& values :
       {R"({"op":"publish","topic":"/cmd","msg":{},"in_reply_to":"9")" + spaces + "}", "{" + spaces + "}"}) {
    plain.say(R"({"service":"/map","message_id":7})");
    answer(provider, only(provider.hear_during(100)), values);
    EXPECT_TRUE(only(plain.hear_during(100)) == R"({"result":)" + values + R"(,"in_reply_to":7})");
  }
}

TEST_F(long_calls_test, that_fail_say_why) {
  peer provider = provider_of_maps();
  peer caller{on};
  const auto called = [&](const std::string& id) {
    caller.say(R"({"op":"call_service","id":)" + id + R"(,"service":"/map"})");
    return only(provider.hear_during(100));
  };
  const std::string itself = called(R"("<a long value>")");
  answer(provider, itself, map_of(20'000));
  EXPECT_TRUE(has(only(caller.hear_during(100)), "a relayed message must not contain <a long value>"));
  const std::string failed = called(R"("c2")");
  provider.say(R"({"op":"service_response","result":false,"id":)" + member(failed, R"("id":)") +
               R"(,"service":"/map","values":")" + std::string(20'000, 'x') + "\"}");
  const std::string heard = only(caller.hear_during(100));
  EXPECT_TRUE(has(heard, R"("result":false)") && has(heard, "the reason has 20"));
}

TEST_F(long_calls_test, whose_answer_nobody_begins_to_write_end_in_time) {
  peer provider = provider_of_maps();
  peer caller{on};
  caller.say(R"({"op":"call_service","id":"c1","service":"/map"})");
  const std::string asked = only(provider.hear_during(100));
  on.net.link_of(caller.id()).capacity_bytes = 0;
  answer(provider, asked, map_of(20'000));
  (void)provider.hear_during(
      350, 100ms); // beyond call_timeout; who pings hears nothing, but may be silent so long
  EXPECT_EQ(on.count(counter::calls_timed_out) + on.count(counter::silent_peers), 1U);
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
}

struct few_long_calls_test : long_calls_test {
  few_long_calls_test() : long_calls_test{4} {}
  // What the provider is told.
  texts called_thrice(peer& caller, peer& provider) {
    for (int i = 0; i < 3; ++i)
      caller.say(R"({"op":"call_service","id":"c)" + std::to_string(i) + R"(","service":"/map"})");
    texts asked = provider.hear_during(100);
    EXPECT_EQ(asked.size(), 3U);
    asked.resize(3);
    return asked;
  }
};

// Who does not read loses the answer to others, and is told.
TEST_F(few_long_calls_test, whose_answer_loses_its_room_are_told) {
  peer provider = provider_of_maps();
  peer caller{on};
  on.net.link_of(caller.id()).capacity_bytes = 0; // nothing is read
  const texts asked = called_thrice(caller, provider);
  for (const std::string& one : asked) {
    answer(provider, one, map_of(50'000));
    on.cycles(20);
  }
  // Now another peer's messages want all the slots.
  peer robot{on};
  peer browser = subscriber(on, "/map");
  std::size_t got = 0;
  for (int i = 0; i < 10; ++i) {
    robot.say(R"({"op":"publish","topic":"/map","msg":)" + map_of(50'000, i) + "}");
    got += browser.hear_during(30).size();
  }
  EXPECT_EQ(got, 10U) << on.count(counter::no_chunks) << " " << on.count(counter::no_slot) << " "
                      << on.count(counter::evicted) << " " << on.count(counter::outbox_full) << " "
                      << robot.close_code << browser.close_code;
  on.net.link_of(caller.id()).capacity_bytes = 1'000'000;
  const texts heard = caller.hear_during(400);
  int fine = 0;
  int failed = 0;
  for (const std::string& one : heard) {
    fine += has(one, R"("result":true)");
    failed += has(one, R"("result":false)") && has(one, "no room");
  }
  EXPECT_EQ(fine + failed, 3) << fine << " " << failed;
  EXPECT_GE(failed, 1);
}

// What is short and was there first is not lost with a long answer behind it.
TEST_F(few_long_calls_test, that_lose_their_room_take_no_short_answer_with_them) {
  peer provider = provider_of_maps();
  peer caller{on};
  on.net.link_of(caller.id()).capacity_bytes = 0;
  const texts asked = called_thrice(caller, provider);
  answer(provider, asked[0], R"({"short":1})");
  answer(provider, asked[1], map_of(50'000));
  answer(provider, asked[2], map_of(50'000));
  on.cycles(40);
  peer robot{on};
  peer browser = subscriber(on, "/map");
  for (int i = 0; i < 10; ++i) {
    robot.say(R"({"op":"publish","topic":"/map","msg":)" + map_of(50'000, i) + "}");
    EXPECT_EQ(browser.hear_during(30).size(), 1U);
  }
  on.net.link_of(caller.id()).capacity_bytes = 1'000'000;
  std::string all;
  for (const std::string& one : caller.hear_during(400)) all += one;
  EXPECT_TRUE(has(all, R"("values":{"short":1})")) << all.substr(0, 300);
  for (const std::string_view id : {"c0", "c1", "c2"}) EXPECT_TRUE(has(all, R"("id":")" + std::string{id}));
}

// A queue that begins with something short gives a long message all the same, and nothing else.
TEST_F(few_long_calls_test, and_maps_of_who_does_not_read_make_way_from_behind_what_is_short) {
  peer robot{on};
  peer deaf{on};
  for (const std::string_view topic : {"/map", "/odom"})
    deaf.say(R"({"op":"subscribe","topic":")" + std::string{topic} + R"("})");
  on.cycle();
  on.net.link_of(deaf.id()).capacity_bytes = 0;
  const auto published = [](std::string_view topic, const std::string& body) {
    return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":)" + body + "}";
  };
  robot.say(published("/map", R"({"short":1})"));
  for (int i = 0; i < 40; ++i) robot.say(published("/odom", R"({"x":1})"));
  for (int i = 0; i < 4; ++i) {
    robot.say(published("/map", map_of(50'000, i)));
    (void)robot.hear_during(20);
  }
  const auto lost = on.count(counter::outbox_full) + on.count(counter::evicted);
  peer browser = subscriber(on, "/grid");
  for (int i = 0; i < 10; ++i) {
    robot.say(published("/grid", map_of(50'000, i)));
    EXPECT_EQ(browser.hear_during(30).size(), 1U) << i;
  }
  EXPECT_LE(on.count(counter::outbox_full) + on.count(counter::evicted) - lost, 4U);
}

TEST(stand_in_test, is_found_where_it_is_once) {
  using rowe::service::find_stand_in;
  const auto object = rowe::service::stand_in_for(rowe::json::kind::object);
  const auto place = find_stand_in(R"({"a":{"<a long value>":0},"b":1})", object);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->at, 5U);
  EXPECT_EQ(place->bytes, object.size());
  EXPECT_FALSE(find_stand_in(R"({"<a long value>":0,"id":1})", object));
  EXPECT_FALSE(find_stand_in(R"({"a":{"<a long value>":0},"b":"<a long value>"})", object));
  EXPECT_FALSE(find_stand_in(R"({"a":"<a long value>"})", object));
  EXPECT_FALSE(find_stand_in(R"({"a":1})", object));
  EXPECT_FALSE(find_stand_in("<a long value>", object));
}

} // namespace
} // namespace core_long_calls_test
} // namespace harness
