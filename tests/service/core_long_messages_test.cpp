// SPDX-License-Identifier: Apache-2.0
// The core with messages that are longer than message_bytes_max: who gets them, what they do to others, and
// what becomes of those that are wrong, or never end.
#include <random>

#include "core_fixtures.hpp"

#include "service/chunk_store.hpp"

namespace harness {
namespace core_long_messages_test {
namespace {

using rowe::service::chunk_store;

rowe::endpoint_options options_with(std::uint32_t long_bytes, std::uint32_t slots = 8) {
  rowe::endpoint_options chosen = small_options();
  chosen.limits.long_message_bytes_max = long_bytes;
  chosen.limits.long_slots = slots;
  chosen.relay = true;
  return chosen;
}

// A JSON object of about so many bytes; each is different.
std::string map_of(std::size_t bytes, int seed = 1) {
  std::mt19937 random{static_cast<std::uint32_t>(seed)};
  std::string made = R"({"data":[0)";
  while (made.size() + 8 < bytes) made += "," + std::to_string(random() % 100);
  return made + R"(],"é":"ü"})";
}
std::string published(std::string_view topic, std::string_view msg) {
  return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":)" + std::string{msg} + "}";
}

// The frame of a text, of which only so many bytes come.
std::vector<std::byte> begun(std::string_view text, std::size_t bytes) {
  std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + bytes);
  const std::size_t header = rowe::wire::write_frame_header(frame.data(), rowe::wire::opcode::text,
                                                            text.size(), rowe::wire::mask_key{});
  text.copy(reinterpret_cast<char*>(frame.data() + header), bytes);
  frame.resize(header + bytes);
  return frame;
}

struct long_messages_test : testing::Test {
  explicit long_messages_test(const rowe::endpoint_options& chosen = options_with(64 * 1024)) : on{chosen} {}
  core_harness on;

  void until_quiet() {
    for (int i = 0; i < 400; ++i) on.cycle();
  }
  // All that a peer is told, while it reads as fast as it can.
  texts heard_by(peer& by, int cycles = 100) {
    texts all;
    for (int i = 0; i < cycles; ++i) {
      on.cycle();
      for (std::string& one : by.hear()) all.push_back(std::move(one));
    }
    return all;
  }
  void TearDown() override { EXPECT_EQ(on.core.inconsistency(), ""); }
};

TEST_F(long_messages_test, reach_the_subscribers_of_every_codec_unchanged) {
  peer robot{on};
  peer browser{on};
  peer bare{on, rowe::service::side::server, "127.0.0.1:2", "/", "rowe.v1"};
  peer cbor{on};
  browser.say(R"({"op":"subscribe","topic":"/map"})");
  bare.say(R"({"op":"subscribe","topic":"map"})");
  cbor.say(R"({"op":"subscribe","topic":"/map","compression":"cbor"})");
  on.cycle();
  (void)bare.hear();
  const std::string map = map_of(40'000);
  robot.say(published("/map", map));
  EXPECT_EQ(heard_by(browser), texts{published("/map", map)});
  EXPECT_EQ(heard_by(bare), texts{published("map", map)});
  const texts in_cbor = heard_by(cbor); // CBOR is not made of what is so long: it is sent as JSON
  EXPECT_EQ(in_cbor.back(), published("/map", map));
  EXPECT_EQ(robot.violated + browser.violated, "");
}

TEST_F(long_messages_test, go_between_other_messages_of_their_publisher_in_their_order) {
  peer robot{on};
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/map"})");
  on.cycle();
  texts expected;
  for (int i = 0; i < 5; ++i) {
    expected.push_back(published("/map", map_of(i % 2 == 0 ? 20'000 : 100, i)));
    robot.say(expected.back());
  }
  EXPECT_EQ(heard_by(browser), expected);
}

TEST_F(long_messages_test, are_refused_with_a_reason_when_they_are_wrong) {
  peer robot{on};
  const auto answer_to = [&](const std::string& text) {
    robot.say(text);
    const texts heard = heard_by(robot);
    return heard.size() == 1 ? heard[0] : "(" + std::to_string(heard.size()) + ")";
  };
  std::string broken = published("/map", map_of(20'000));
  broken[15'000] = 'x';
  EXPECT_NE(answer_to(broken).find("no valid JSON"), std::string::npos) << answer_to(broken);
  EXPECT_NE(answer_to("[" + std::string(20'000, ' ') + "1]").find("must be a JSON object"),
            std::string::npos);
  const std::string two = R"({"op":"publish","topic":"/map","x":")" + std::string(10'000, 'x') +
                          R"(","msg":)" + map_of(11'000) + "}";
  EXPECT_NE(answer_to(two).find("only one member"), std::string::npos) << answer_to(two);
  std::string many = R"({"op":"publish","topic":"/map")";
  for (int i = 0; i < 20; ++i) many += ",\"m" + std::to_string(i) + "\":0";
  many += R"(,"msg":)" + map_of(20'000) + "}";
  EXPECT_NE(answer_to(many).find("must be one of its first 16"), std::string::npos) << answer_to(many);
  const std::string call = R"({"op":"call_service","service":"/x","args":)" + map_of(20'000) + "}";
  EXPECT_NE(answer_to(call).find("message_bytes_max"), std::string::npos) << answer_to(call);
  EXPECT_EQ(on.count(rowe::service::counter::violations), 0U);
}

TEST_F(long_messages_test, stop_even_so) {
  rowe::endpoint_options chosen = options_with(64 * 1024);
  core_harness other{chosen};
  auto& latch = other.offer({.kind = rowe::detail::pair_kind::stop_latch, .name = "loop"});
  (void)latch;
  other.cycle();
  peer robot{other};
  robot.say(R"({"op":"call_service","service":"/rowe/stop","args":{"reason":")" + std::string(20'000, 'x') +
            R"("}})");
  for (int i = 0; i < 20; ++i) other.cycle();
  EXPECT_EQ(other.count(rowe::service::counter::stops), 1U);
}

TEST_F(long_messages_test, end_a_connection_only_beyond_their_own_limit) {
  peer robot{on};
  robot.say(published("/map", map_of(70'000)));
  until_quiet();
  (void)robot.hear();
  EXPECT_EQ(robot.close_code, 1009);
  EXPECT_NE(robot.close_reason.find("long_message_bytes_max of 65536"), std::string::npos)
      << robot.close_reason;
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
    EXPECT_EQ(heard_by(late), texts{published("/map", map)});
    late.leave();
    on.cycle();
  }
  robot.leave();
  on.cycle();
  peer later{on};
  later.say(R"({"op":"subscribe","topic":"/map"})");
  EXPECT_TRUE(heard_by(later).empty()); // the value went with its publisher
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
    robot.say(published("/pose", R"({"x":1})"));
    on.cycle();
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
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/map"})");
  on.cycle();
  robot.say(published("/map", map_of(60'000)));
  EXPECT_EQ(heard_by(browser).size(), 1U);
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
  texts heard;
  for (int i = 0; i < 120; ++i) {
    on.cycle(10ms);
    for (std::string& one : quick.hear()) heard.push_back(std::move(one));
  }
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
  EXPECT_TRUE(heard_by(robot).empty()); // no status says `full`
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 0U);
}

TEST_F(few_long_messages_test, for_which_there_is_no_room_are_counted_and_told) {
  peer first{on};
  first.send_raw(begun(published("/map", map_of(60'000)), 1));
  on.cycle();
  peer second{on};
  second.say(published("/map", map_of(60'000)));
  const texts told = heard_by(second);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("60"), std::string::npos);
  EXPECT_NE(told[0].find("send it again later"), std::string::npos) << told[0];
  EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 1U);
}

TEST_F(long_messages_test, give_back_all_chunks) {
  {
    peer robot{on};
    peer browser{on};
    browser.say(R"({"op":"subscribe","topic":"/map"})");
    on.cycle();
    for (int i = 0; i < 30; ++i) {
      robot.say(published("/map", map_of(50'000, i)));
      (void)heard_by(browser, 20);
    }
    EXPECT_EQ(on.count(rowe::service::counter::no_chunks), 0U);
    robot.say(published("/map", map_of(50'000)));
    on.cycle();
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
