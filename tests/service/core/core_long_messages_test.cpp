// SPDX-License-Identifier: Apache-2.0
// The core with messages that are longer than message_bytes_max: who gets them, what they do to others, and
// what becomes of those that are wrong, or never end.
#include <optional>

#include "long_fixtures.hpp"

#include "service/base/chunk_store.hpp"

namespace harness {
namespace core_long_messages_test {
namespace {

using namespace long_fixtures;
using rowe::service::chunk_store;

struct long_messages_test : core_test {
  explicit long_messages_test(const rowe::endpoint_options& chosen = options_with(64 * 1024))
      : core_test{chosen} {}
  void until_quiet() {
    for (int i = 0; i < 400; ++i) on.cycle();
  }
};

TEST_F(long_messages_test, reach_the_subscribers_of_every_codec_unchanged) {
  peer robot{on};
  peer browser{on};
  peer plain{on, rowe::service::side::server, "127.0.0.1:2", "/", "rowe.v1"};
  peer cbor{on};
  browser.say(R"({"op":"subscribe","topic":"/map"})");
  plain.say(R"({"op":"subscribe","topic":"map"})");
  cbor.say(R"({"op":"subscribe","topic":"/map","compression":"cbor"})");
  (void)plain.hear_after(1);
  const std::string map = map_of(40'000);
  robot.say(published("/map", map));
  EXPECT_EQ(browser.hear_during(100), texts{published("/map", map)});
  EXPECT_EQ(plain.hear_during(100), texts{published("map", map)});
  const texts in_cbor = cbor.hear_during(100); // CBOR is not made of what is so long: it is sent as JSON
  EXPECT_EQ(in_cbor.back(), published("/map", map));
  EXPECT_EQ(robot.violated + browser.violated, "");
}

TEST_F(long_messages_test, go_between_other_messages_of_their_publisher_in_their_order) {
  peer robot{on};
  peer browser = subscriber(on, "/map");
  texts expected;
  for (int i = 0; i < 5; ++i) {
    expected.push_back(published("/map", map_of(i % 2 == 0 ? 20'000 : 100, i)));
    robot.say(expected.back());
  }
  EXPECT_EQ(browser.hear_during(100), expected);
}

TEST_F(long_messages_test, are_refused_with_a_reason_when_they_are_wrong) {
  peer robot{on};
  const auto answer_to = [&](const std::string& text) {
    robot.say(text);
    const texts heard = robot.hear_during(100);
    return heard.size() == 1 ? heard[0] : "(" + std::to_string(heard.size()) + ")";
  };
  std::string broken = published("/map", map_of(20'000));
  broken[15'000] = 'x';
  EXPECT_TRUE(has(answer_to(broken), "no valid JSON")) << answer_to(broken);
  EXPECT_TRUE(has(answer_to("[" + std::string(20'000, ' ') + "1]"), "must be a JSON object"));
  const std::string two = R"({"op":"publish","topic":"/map","x":")" + std::string(10'000, 'x') +
                          R"(","msg":)" + map_of(11'000) + "}";
  EXPECT_TRUE(has(answer_to(two), "only one member")) << answer_to(two);
  std::string many = R"({"op":"publish","topic":"/map")";
  for (int i = 0; i < 20; ++i) many += ",\"m" + std::to_string(i) + "\":0";
  many += R"(,"msg":)" + map_of(20'000) + "}";
  EXPECT_TRUE(has(answer_to(many), "must be one of its first 16")) << answer_to(many);
  const std::string request = R"({"op":"advertise","topic":"/x","x":)" + map_of(20'000) + "}";
  EXPECT_TRUE(has(answer_to(request), "message_bytes_max")) << answer_to(request);
  EXPECT_EQ(on.count(rowe::service::counter::violations), 0U);
}

std::string with_id(std::string_view id, std::string text) {
  return R"({"id":")" + std::string{id} + "\"," + text.substr(1);
}

// A peer of each codec says something long that is refused, and looks at what it is told.
struct refused_long_messages_test : long_messages_test {
  std::string told(peer& by) {
    std::string all;
    for (const std::string& one : by.hear_during(100)) all += one;
    return all;
  }
  std::string answer_to(peer& by, const std::string& text) {
    by.say(text);
    return told(by);
  }
  // Somebody takes all the room for messages that are not complete.
  void fill() {
    filler_.emplace(on);
    filler_->send_raw(begun(published("/map", map_of(60'000)), 1));
    on.cycle();
    second_filler_.emplace(on);
    second_filler_->send_raw(begun(published("/map", map_of(60'000)), 1));
    on.cycle();
  }
  std::optional<peer> filler_, second_filler_;
};

TEST_F(refused_long_messages_test, name_the_topic_and_the_id_to_a_peer_of_rosbridge) {
  peer robot{on};
  std::string broken = with_id("m7", published("/map", map_of(20'000)));
  broken[15'000] = 'x';
  std::string heard = answer_to(robot, broken);
  EXPECT_TRUE(has(heard, "publish /map: the text is no valid JSON") && has(heard, R"("id":"m7")"));
  std::string infinite = published("/map", R"({"x":[)" + std::string(20'000, ' ') + "NaN]}");
  heard = answer_to(robot, infinite);
  EXPECT_TRUE(has(heard, "publish /map: the text is no valid JSON, which has no NaN (at byte "));
  const std::string two =
      with_id("m8", R"({"x":")" + std::string(10'000, 'x') + R"(","op":"publish","topic":"/map","msg":)" +
                        map_of(11'000) + "}");
  heard = answer_to(robot, two); // what it is stands behind more than is kept of other messages
  EXPECT_TRUE(has(heard, "publish /map: only one member") && has(heard, R"("id":"m8")"));
  std::string many = R"({"op":"publish","id":3,"topic":"/map")";
  for (int i = 0; i < 20; ++i) many += ",\"m" + std::to_string(i) + "\":0";
  heard = answer_to(robot, many + R"(,"msg":)" + map_of(20'000) + "}");
  EXPECT_TRUE(has(heard, "publish /map: the long member") && has(heard, R"("id":3)"));
  heard =
      answer_to(robot, with_id("m9", R"({"op":"publish","topic":"/rowe/x","msg":)" + map_of(20'000) + "}"));
  EXPECT_TRUE(has(heard, "endpoint's own") && has(heard, R"("id":"m9")"));
  heard = answer_to(robot, with_id("m1", R"({"op":"advertise","topic":"/map","type":")" +
                                             std::string(20'000, 'x') + R"("})"));
  EXPECT_TRUE(has(heard, R"("id":"m1")") && has(heard, "advertise /map: a message of 20"));
  EXPECT_EQ(robot.close_code, 0);
}

TEST_F(refused_long_messages_test, fail_the_calls_that_they_are) {
  peer robot{on};
  std::string heard = answer_to(
      robot, R"({"op":"call_service","id":"c1","service":"/rosapi/topics","args":)" + map_of(20'000) + "}");
  EXPECT_TRUE(has(heard, R"("op":"service_response")") && has(heard, R"("id":"c1")") &&
              has(heard, R"("result":false)") && has(heard, "20"))
      << heard;
  EXPECT_TRUE(has(heard, "the limit message_bytes_max of "));
  heard = answer_to(robot, R"({"op":"call_service","id":"c2","args":)" + map_of(20'000) + "}");
  EXPECT_TRUE(has(heard, R"("op":"service_response")") &&
              has(heard, R"("id":"c2")")); // though its service is not known
  peer plain{on, rowe::service::side::server, "127.0.0.1:2", "/", "rowe.v1"};
  heard = answer_to(plain, R"({"service":"rosapi/topics","message_id":17,"data":)" + map_of(20'000) + "}");
  EXPECT_TRUE(has(heard, R"("in_reply_to":17)") && has(heard, "too_big"));
  heard = answer_to(plain, R"({"service":"x","message_id":18,"data":)" + map_of(20'000) + ",}");
  EXPECT_TRUE(has(heard, R"("in_reply_to":18)") && has(heard, "malformed"));
}

TEST_F(refused_long_messages_test, fail_the_calls_that_they_answer) {
  peer provider{on};
  provider.say(R"({"op":"advertise_service","service":"/map","type":"nav_msgs/GetMap"})");
  peer caller{on};
  on.cycle();
  caller.tell(R"({"op":"call_service","id":"c1","service":"/map"})", 2);
  const std::string asked = only(provider.hear());
  const std::size_t at = asked.find(R"("id":)") + 5;
  const std::string id = asked.substr(at, asked.find_first_of(",}", at) - at);
  const std::string heard =
      answer_to(provider, R"({"op":"service_response","id":)" + id + R"(,"service":"/map","x":")" +
                              std::string(9'000, 'x') + R"(","values":)" + map_of(20'000) + "}");
  EXPECT_TRUE(has(heard, "service_response /map: only one member") && has(heard, id));
  const std::string failed = told(caller);
  EXPECT_TRUE(has(failed, R"("id":"c1")") && has(failed, R"("result":false)") &&
              has(failed, "only one member"))
      << failed;
}

TEST_F(refused_long_messages_test, name_the_topic_by_its_number_to_a_peer_of_foxglove) {
  peer robot{on, rowe::service::side::server, "127.0.0.1:2", "/", "foxglove.websocket.v1"};
  robot.say(R"({"op":"advertise","channels":[{"id":5,"topic":"/map","encoding":"json"}]})");
  (void)told(robot);
  const auto answer = [&](const std::string& bytes) {
    robot.send(rowe::wire::opcode::binary, bytes);
    return told(robot);
  };
  std::string broken = "\x01" + four(5) + map_of(20'000);
  broken[15'000] = 'x';
  std::string heard = answer(broken);
  EXPECT_TRUE(has(heard, "publish /map: the text is no valid JSON"));
  heard = answer("\x02" + four(4000) + four(10) + four(4) + "json" + map_of(20'000));
  EXPECT_TRUE(has(heard, R"({"op":"serviceCallFailure","serviceId":4000,"callId":10,)"));
  heard = answer("\x09" + map_of(20'000));
  EXPECT_TRUE(has(heard, "begins with 9"));
  EXPECT_EQ(on.count(rowe::service::counter::too_big), 1U);
  fill();
  heard = answer("\x01" + four(5) + map_of(60'000));
  EXPECT_TRUE(has(heard, "publish /map: a message of 60") && has(heard, "long_slots"));
}

TEST_F(refused_long_messages_test, name_the_topic_and_the_id_where_there_was_no_room) {
  fill();
  peer robot{on};
  std::string heard = answer_to(robot, with_id("m7", published("/map", map_of(60'000))));
  EXPECT_TRUE(has(heard, "publish /map: a message of 60") && has(heard, R"("id":"m7")"));
  peer plain{on, rowe::service::side::server, "127.0.0.1:2", "/", "rowe.v1"};
  heard = answer_to(plain, R"({"service":"x","message_id":17,"data":)" + map_of(60'000) + "}");
  EXPECT_TRUE(has(heard, R"("in_reply_to":17)") && has(heard, R"("code":"full")"));
  // Its topic is behind what is kept of it.
  heard = answer_to(robot, R"({"op":"publish","msg":)" + map_of(60'000) + R"(,"topic":"/map"})");
  EXPECT_TRUE(has(heard, R"("publish: a message of 60)"));
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 3U);
}

struct long_stops_test : refused_long_messages_test {
  long_stops_test() { on.offer_now(rowe::detail::latch_request({.name = "loop"})); }
  void expect_stop_by(peer& by, const std::string& text, bool binary = false) {
    const auto before = on.count(rowe::service::counter::stops);
    by.send(binary ? rowe::wire::opcode::binary : rowe::wire::opcode::text, text);
    for (int i = 0; i < 40; ++i) on.cycle();
    EXPECT_EQ(on.count(rowe::service::counter::stops), before + 1) << text.substr(0, 100);
  }
  // Longer than message_bytes_max, in each codec.
  void expect_stops(std::size_t bytes) {
    const std::string reason = R"({"reason":")" + std::string(bytes, 'x') + R"("})";
    peer robot{on};
    expect_stop_by(robot, R"({"op":"call_service","id":"s1","service":"/rowe/stop","args":)" + reason + "}");
    on.cycles(200);
    const std::string answer = told(robot);
    EXPECT_TRUE(has(answer, R"("state":"stopped")") && has(answer, R"("id":"s1")"));
    expect_stop_by(robot, published("/rowe/stop", reason));
    expect_stop_by(robot, published("rowe/stop", reason));
    expect_stop_by(robot, R"({"service":"/rowe/stop","data":)" + reason + "}");
    expect_stop_by(robot, R"({"op":"publish","latch":7,"topic":"/rowe/stop","msg":)" + reason + "}");
    peer fox{on, rowe::service::side::server, "127.0.0.1:2", "/", "foxglove.websocket.v1"};
    expect_stop_by(fox, "\x02" + four(1) + four(3) + four(4) + "json" + reason, true);
  }
};

TEST_F(long_stops_test, are_carried_out) { expect_stops(20'000); }

TEST_F(long_stops_test, are_carried_out_where_there_is_no_room_for_them) {
  fill();
  expect_stops(60'000);
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 0U);
}

TEST_F(long_stops_test, are_carried_out_where_they_have_two_long_members) {
  peer robot{on};
  const std::string filler = std::string(9'000, 'x');
  expect_stop_by(robot, R"({"x":")" + filler + R"(","op":"publish","topic":"/rowe/stop","msg":{"y":")" +
                            filler + R"("}})");
}

TEST_F(long_stops_test, are_none_where_the_text_is_no_json_or_asks_for_something_else) {
  peer robot{on};
  std::string broken = published("/rowe/stop", map_of(20'000));
  broken[15'000] = 'x';
  robot.say(broken);
  robot.say(published("/map", R"({"topic":"/rowe/stop","x":")" + std::string(20'000, 'x') + R"("})"));
  until_quiet();
  EXPECT_EQ(on.count(rowe::service::counter::stops), 0U);
  fill();
  robot.say(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":1},"x":")" +
            std::string(60'000, 'x') + R"("})");
  until_quiet();
  EXPECT_EQ(on.count(rowe::service::counter::stops), 0U);
  const std::string heard = told(robot);
  EXPECT_TRUE(has(heard, R"("result":false)"));
}

// The limit: a name that stands behind 4 KiB is not found where nothing else was kept.
TEST_F(long_stops_test, need_their_name_in_front_where_there_is_no_room) {
  peer robot{on};
  const std::string late = R"({"op":"publish","msg":)" + map_of(60'000) + R"(,"topic":"/rowe/stop"})";
  expect_stop_by(robot, late);
  fill();
  robot.say(late);
  until_quiet();
  EXPECT_EQ(on.count(rowe::service::counter::stops), 1U);
}

TEST_F(long_messages_test, end_a_connection_only_beyond_their_own_limit) {
  peer robot{on};
  robot.say(published("/map", map_of(70'000)));
  until_quiet();
  (void)robot.hear();
  EXPECT_EQ(robot.close_code, 1009);
  EXPECT_TRUE(has(robot.close_reason, "long_message_bytes_max of 65536")) << robot.close_reason;
}

TEST_F(long_messages_test, are_latched_for_late_subscribers_without_a_copy) {
  peer robot{on};
  robot.say(R"({"op":"advertise","topic":"/map","type":"nav_msgs/OccupancyGrid","latch":true})");
  const std::string map = map_of(30'000);
  robot.say(published("/map", map));
  until_quiet();
  for (int i = 0; i < 3; ++i) {
    peer late{on};
    late.say(R"({"op":"subscribe","topic":"/map"})");
    EXPECT_EQ(late.hear_during(100), texts{published("/map", map)});
    late.leave();
    on.cycle();
  }
  robot.leave();
  on.cycle();
  peer later{on};
  later.say(R"({"op":"subscribe","topic":"/map"})");
  EXPECT_TRUE(later.hear_during(100).empty()); // the value went with its publisher
}

TEST_F(long_messages_test, let_control_frames_pass_and_other_peers_too) {
  peer robot{on};
  peer slow{on};
  peer quick{on};
  slow.say(R"({"op":"subscribe","topic":"/map"})");
  quick.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.link_of(slow.id()).capacity_bytes = 1000; // it takes little at a time
  robot.say(published("/map", map_of(60'000)));
  until_quiet();
  int poses = 0;
  for (int i = 0; i < 20; ++i) {
    robot.tell(published("/pose", R"({"x":1})"));
    poses += static_cast<int>(quick.hear().size());
  }
  EXPECT_EQ(poses, 20);
  texts got;
  for (int i = 0; i < 400 && got.empty(); ++i) {
    if (i == 10) slow.send(rowe::wire::opcode::ping, "between");
    got = slow.hear();
    on.cycle();
  }
  EXPECT_EQ(got, texts{published("/map", map_of(60'000))});
  EXPECT_EQ(slow.violated, "");
  EXPECT_GE(slow.pongs, 1);
}

TEST_F(long_messages_test, that_never_end_keep_out_nobody_for_long) {
  std::vector<peer> hostile;
  for (int i = 0; i < 4; ++i) {
    hostile.emplace_back(on);
    hostile.back().send_raw(begun(published("/map", map_of(60'000)), 20'000));
    on.cycle(20ms);
  }
  for (int i = 0; i < 60; ++i) on.cycle(20ms);
  peer robot{on};
  peer browser = subscriber(on, "/map");
  robot.say(published("/map", map_of(60'000)));
  EXPECT_EQ(browser.hear_during(100).size(), 1U);
}

struct few_long_messages_test : long_messages_test { // a quarter of the chunks is one message
  few_long_messages_test() : long_messages_test{options_with(64 * 1024, 4)} {}
};

TEST_F(few_long_messages_test, that_somebody_does_not_read_keep_others_from_theirs_for_a_second) {
  peer robot{on};
  peer deaf{on};
  peer quick{on};
  for (peer* one : {&deaf, &quick}) one->say(R"({"op":"subscribe","topic":"/map"})");
  on.cycle();
  on.net.link_of(deaf.id()).capacity_bytes = 1000;
  const texts maps = {published("/map", map_of(60'000, 1)), published("/map", map_of(60'000, 2))};
  for (const std::string& one : maps) robot.say(one);
  texts heard = quick.hear_during(120, 10ms);
  EXPECT_EQ(heard, maps);
  EXPECT_EQ(on.count(rowe::service::counter::stalled_peers), 1U);
  EXPECT_TRUE(deaf.cut());
}

// One that announces all the room, leaves and comes again has it no longer than one that stays.
TEST_F(few_long_messages_test, of_one_that_comes_again_and_again_do_not_take_the_room_from_who_stays) {
  peer robot{on};
  const std::string map = published("/map", map_of(60'000));
  for (int i = 0; i < 20; ++i) {
    peer hostile{on};
    hostile.send_raw(begun(map, 1));
    for (int ms = 0; ms < 200; ms += 20) on.cycle(20ms);
    if (i == 19) robot.say(map);
    on.cycle(20ms);
    hostile.leave();
    on.cycle(20ms);
  }
  EXPECT_TRUE(robot.hear_during(100).empty()); // no status says `full`
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 0U);
}

TEST_F(few_long_messages_test, for_which_there_is_no_room_are_counted_and_told) {
  peer first{on};
  first.send_raw(begun(published("/map", map_of(60'000)), 1));
  on.cycle();
  peer second{on};
  second.say(published("/map", map_of(60'000)));
  const std::string told = only(second.hear_during(100));
  EXPECT_TRUE(has(told, "60"));
  EXPECT_TRUE(has(told, "send it again later"));
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 1U);
}

TEST_F(long_messages_test, give_back_all_chunks) {
  {
    peer robot{on};
    peer browser = subscriber(on, "/map");
    for (int i = 0; i < 30; ++i) {
      robot.say(published("/map", map_of(50'000, i)));
      (void)browser.hear_during(20);
    }
    EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 0U);
    robot.tell(published("/map", map_of(50'000)));
    browser.leave();
    robot.leave();
  }
  until_quiet();
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
}

} // namespace
} // namespace core_long_messages_test
} // namespace harness
