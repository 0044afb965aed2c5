// SPDX-License-Identifier: Apache-2.0
// The core as a server: a connection from beginning to end, statistics, and when the next cycle is needed.
#include "core_fixtures.hpp"

namespace harness {
namespace core_connection_test {
namespace {

// A frame of one byte that does not end its message.
std::array<std::byte, 7> fragment(std::uint8_t opcode) {
  return {std::byte{opcode}, std::byte{0x81}, {}, {}, {}, {}, std::byte{'a'}};
}

TEST_F(core_test, answers_a_ping_and_a_close) {
  peer p{on};
  p.send(rowe::wire::opcode::ping, "are you there");
  (void)p.hear_after(1);
  EXPECT_EQ(p.pongs, 1);
  p.send(rowe::wire::opcode::close, std::string_view{"\x03\xe8", 2});
  (void)p.hear_after(1);
  EXPECT_EQ(p.close_code, 1000);
  EXPECT_TRUE(p.cut());
}

TEST_F(core_test, passes_on_a_warning_of_the_transport_and_blames_nobody) {
  static_cast<rowe::service::transport_sink&>(on.core).on_warning("the certificate ends in 5 days",
                                                                  "renew it");
  const auto told = on.shared.try_event();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->what_kind, rowe::event::kind::warning);
  EXPECT_EQ(std::string_view{told->what}, "the certificate ends in 5 days");
  EXPECT_EQ(std::string_view{told->remedy}, "renew it");
  EXPECT_EQ(on.count(counter::refused_handshakes), 0U);
}

TEST_F(core_test, answers_the_latest_ping_however_many_came_before) {
  peer p{on};
  for (int i = 0; i < 10; ++i) p.send(rowe::wire::opcode::ping, std::string(125, static_cast<char>('a' + i)));
  on.cycle();
  const auto sent = on.net.sent(p.id());
  const std::string bytes{reinterpret_cast<const char*>(sent.data()), sent.size()};
  EXPECT_TRUE(bytes.ends_with(std::string(125, 'j'))) << "the pong to the latest";
  p.hear();
  EXPECT_EQ(p.pongs, 3);
}

TEST(core, wakes_for_a_crowd_of_quiet_peers_sixty_times_a_second_at_most) {
  constexpr int crowd = 100;
  core_harness on{with_limits(small_options(), &limits::connections_max, crowd)};
  std::vector<peer> peers;
  for (int i = 0; i < crowd; ++i) {
    peers.emplace_back(on);
    on.cycle(3777us);
  }
  int wakes = 0;
  for (const auto until = on.now + 2s; on.now < until; ++wakes) on.cycle(on.next_wake - on.now);
  EXPECT_LE(wakes, 120);
  EXPECT_TRUE(on.core.check());
}

TEST_F(core_test, writes_what_it_has_answered_before_it_answers_a_close) {
  peer p{on};
  p.say(R"({"op":"call_service","id":"1","service":"/rosapi/services"})");
  p.send(rowe::wire::opcode::close, std::string("\x03\xe8", 2));
  EXPECT_EQ(p.hear_after(1).size(), 1U);
  EXPECT_EQ(p.close_code, 1000);
}

TEST_F(core_test, writes_nothing_after_its_close_frame) {
  auto& pair = advertise_pose(on);
  peer p = subscriber(on, "/pose");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  p.send(rowe::wire::opcode::close, "");
  EXPECT_TRUE(p.hear_after(2).empty());
  EXPECT_EQ(p.violated, "");
}

TEST_F(core_test, closes_a_connection_that_breaks_the_protocol_with_the_code_for_it) {
  peer p{on};
  const std::byte unmasked[] = {std::byte{0x81}, std::byte{1}, std::byte{'x'}};
  p.send_raw(unmasked);
  (void)p.hear_after(1);
  EXPECT_EQ(p.close_code, 1002);
  EXPECT_EQ(on.count(counter::violations), 1U);
}

TEST_F(core_test, refuses_a_message_larger_than_its_limit_with_1009) {
  peer p{on};
  (void)p.ask(std::string(9000, ' '));
  EXPECT_EQ(p.close_code, 1009);
}

TEST_F(core_test, pings_a_silent_peer_and_keeps_it_while_it_answers) {
  peer p{on};
  (void)p.hear_during(60, 500ms);
  EXPECT_GE(p.pings, 5);
  EXPECT_FALSE(p.cut());
}

TEST_F(core_test, holds_nothing_against_its_peers_that_passed_while_the_process_did_not_run) {
  peer listens{on};
  peer writes{on};
  peer gone{on};
  gone.answers_pings = false;
  on.cycle();
  writes.send_raw(fragment(0x01));
  on.cycle(3500ms); // all of them are asked whether they are there
  for (const rowe::rt::duration time : {rowe::rt::duration{9s}, rowe::rt::duration{1h}}) {
    on.pause(time);
    on.cycles(3);
    for (peer* one : {&listens, &writes}) EXPECT_EQ(one->close_code, 0);
    EXPECT_FALSE(listens.cut() || writes.cut() || gone.cut());
    for (peer* one : {&listens, &writes, &gone}) (void)one->hear();
    on.cycles(3);
  }
  EXPECT_EQ(on.count(counter::pauses), 2U);
  for (int i = 0; i < 20; ++i) {
    on.cycle(500ms);
    for (peer* one : {&listens, &writes, &gone}) (void)one->hear();
  }
  EXPECT_EQ(listens.close_code, 0);
  EXPECT_EQ(gone.close_code, 1008) << "it was asked again, and is not there";
  EXPECT_EQ(on.count(counter::silent_peers), 1U);
  EXPECT_EQ(on.count(counter::unfinished_messages), 1U) << "it had its time again, and did not use it";
}

TEST_F(core_test, cuts_a_peer_that_does_not_finish_its_message_though_it_goes_on_sending) {
  peer p{on};
  on.cycle();
  p.send_raw(fragment(0x01));
  for (int i = 0; i < 13; ++i) {
    on.cycle(500ms);
    p.send_raw(fragment(0x00));
    (void)p.hear();
  }
  EXPECT_EQ(p.close_code, 1008);
  EXPECT_EQ(on.count(counter::unfinished_messages), 1U);
}

TEST_F(core_test, gives_everything_back_when_a_peer_vanishes_in_the_middle_of_a_frame) {
  auto& pair = advertise_pose(on);
  peer p = subscriber(on, "/pose");
  on.net.link_of(p.id()).capacity_bytes = 10;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  on.cycle();
  EXPECT_GT(on.core.slots_in_use(), 0U);
  p.leave(rowe::service::close_cause::reset);
  on.cycles(2);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_EQ(on.count(counter::lost_with_peer), 5U);
  EXPECT_EQ(on.shared.peers(), 0U);
}

TEST_F(core_test, continues_a_frame_where_the_socket_stopped_taking_it) {
  auto& pair = advertise_pose(on);
  peer p = subscriber(on, "/pose");
  on.net.link_of(p.id()).capacity_bytes = 3;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  EXPECT_EQ(p.hear_during(200), (texts{message(0), message(1), message(2)}));
}

TEST_F(core_test, sends_peers_a_close_frame_when_it_closes) {
  peer p{on};
  on.cycle();
  on.core.close_all(on.now);
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1001);
}

TEST_F(core_test, publishes_its_statistics_at_their_period_while_somebody_listens) {
  auto& pair = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  texts reports;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(publish_now(on, pair, {1, 0}));
    for (auto& text : p.hear()) {
      if (text.find("/rowe/stats\",\"msg") != std::string::npos) reports.push_back(std::move(text));
    }
  }
  ASSERT_GE(reports.size(), 9U);
  EXPECT_LE(reports.size(), 10U);
  EXPECT_TRUE(has(reports.back(), R"("name":"robot")")) << reports.back();
  EXPECT_TRUE(has(reports.back(), R"("topic":"/pose","type":"test/Pose")")) << reports.back();
  EXPECT_TRUE(has(reports.back(), R"("losses":{"full":0)")) << reports.back();
  EXPECT_LE(p.ask(R"({"op":"unsubscribe","topic":"/rowe/stats"})").size(), 1U);
  on.cycles(300);
  for (const auto& text : p.hear()) EXPECT_FALSE(has(text, "stats"));
}

TEST_F(core_test, counts_rates_from_the_time_somebody_listens_to_them) {
  auto& pair = advertise_pose(on);
  peer p = subscriber(on, "/pose");
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(publish(on, pair, {1, 0}));
    (void)p.hear_after(1);
  }
  p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
  std::string report;
  for (int i = 0; i < 150 && report.empty(); ++i) {
    ASSERT_TRUE(publish_now(on, pair, {1, 0}));
    for (const auto& text : p.hear()) {
      if (text.find("rate_hz") != std::string::npos) report = text;
    }
  }
  const auto at = report.find(R"("rate_hz":)", report.find("/pose"));
  ASSERT_NE(at, std::string::npos) << report;
  const double rate = std::stod(report.substr(at + 10));
  EXPECT_GT(rate, 900) << report;
  EXPECT_LT(rate, 1100) << report;
}

// Of one topic, as the service /rowe/stats says it.
struct rate_report {
  double hz = -1;
  double over_s = -1;
  double gap_ms = -1;
};
rate_report rate_of_pose(peer& p) {
  p.tell(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  for (const auto& text : p.hear()) {
    if (text.find("service_response") == std::string::npos) continue;
    const auto number = [&](std::string_view key, std::size_t from) {
      const auto at = text.find(key, from);
      return at == std::string::npos ? -1 : std::stod(text.substr(at + key.size()));
    };
    const auto topic = text.find(R"("topic":"/pose")");
    return {number(R"("rate_hz":)", topic), number(R"("rates_over_s":)", 0),
            number(R"("gap_ms_max":)", topic)};
  }
  return {};
}

TEST_F(core_test, reports_rates_of_the_last_seconds_though_nobody_subscribed_to_them) {
  auto& pair = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  (void)p.hear_during(400, 250ms); // it has been up for a while
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(publish(on, pair, {1, 0}));
    (void)p.hear_during(1, 10ms);
  }
  const rate_report busy = rate_of_pose(p);
  EXPECT_GE(busy.over_s, 1);
  EXPECT_LE(busy.over_s, 2.1);
  EXPECT_NEAR(busy.hz, 100, 5);
  EXPECT_NEAR(busy.gap_ms, 10, 1);
  (void)p.hear_during(40, 100ms);
  EXPECT_EQ(rate_of_pose(p).hz, 0);
}

TEST_F(core_test, reports_the_same_rates_while_somebody_subscribes_to_them) {
  auto& pair = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
  on.cycle();
  for (int i = 0; i < 305; ++i) {
    ASSERT_TRUE(publish(on, pair, {1, 0}));
    (void)p.hear_during(1, 10ms);
  }
  const rate_report both = rate_of_pose(p);
  EXPECT_GE(both.over_s, 1);
  EXPECT_NEAR(both.hz, 100, 5);
  EXPECT_NEAR(both.gap_ms, 10, 1);
}

TEST_F(core_test, tells_its_own_process_statistics_that_it_subscribes_to) {
  auto& inbox = on.offer(rowe::detail::pair_kind::subscribe_text, "/rowe/stats", 4000);
  on.cycles(300);
  EXPECT_TRUE(take(inbox));
}

TEST_F(core_test, has_nothing_to_wake_for_without_peers) {
  advertise_pose_now(on);
  EXPECT_EQ(on.next_wake, rowe::rt::never);
  EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
}

TEST_F(core_test, must_look_at_lanes_while_somebody_listens) {
  advertise_pose(on);
  peer p = subscriber(on, "/pose");
  EXPECT_EQ(on.core.idle_time_max(1ms), 1ms);
  p.leave();
  on.cycles(2);
  EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
}

} // namespace
} // namespace core_connection_test
} // namespace harness
