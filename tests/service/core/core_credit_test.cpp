// SPDX-License-Identifier: Apache-2.0
// What is in flight to a peer, and the pings that say so.
#include "core_fixtures.hpp"

#include "service/outgoing/credit.hpp"

namespace harness {
namespace core_credit_test {
namespace {

using rowe::service::credit;

struct core_credit : core_test {
  explicit core_credit(rowe::endpoint_options options = roomy()) : core_test{options} {}

  static rowe::endpoint_options roomy() {
    return with_limits(small_options(), &limits::small_slots, 256, &limits::queue_depth_max, 200);
  }

  std::deque<peer> viewers;
  rowe::detail::queue_pair& telemetry = offer("/telemetry", rowe::priority::normal);
  rowe::detail::queue_pair& alarm = offer("/alarm", rowe::priority::urgent);

  peer& viewer() {
    auto& p = viewers.emplace_back(on);
    p.say(R"({"op":"subscribe","topic":"/telemetry"})");
    p.say(R"({"op":"subscribe","topic":"/alarm"})");
    on.cycle();
    return p;
  }
  // More than may be in flight to somebody who does not read.
  void saturate() {
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(publish_text(on, telemetry, R"({"x":")" + std::string(400, 'x') + "\"}"));
      if (i % 50 == 49) on.cycle(100us);
    }
  }

  rowe::detail::queue_pair& offer(std::string_view topic, rowe::priority priority) {
    return on.offer(rowe::detail::pair_kind::publish_text, topic, 500, {.priority = priority});
  }
};

struct core_credit_hop : core_credit {
  static rowe::endpoint_options hop() {
    auto options = roomy();
    options.profile = rowe::websocket_profile::hop;
    return options;
  }
  core_credit_hop() : core_credit{hop()} {}
};

TEST_F(core_credit, holds_back_telemetry_that_is_not_read_and_lets_an_urgent_message_overtake_it) {
  peer& p = viewer();
  saturate();
  const std::size_t telemetry_in_flight = on.net.sent(p.id()).size();
  EXPECT_GE(telemetry_in_flight, credit::bytes_min);
  EXPECT_LE(telemetry_in_flight, credit::bytes_min + 500);
  ASSERT_TRUE(publish_text_now(on, alarm, R"({"stop":1})"));
  EXPECT_GT(on.net.sent(p.id()).size(), telemetry_in_flight);
  EXPECT_LT(on.net.sent(p.id()).size(), telemetry_in_flight + 100);
  const texts heard = p.hear();
  EXPECT_LT(heard.size(), 50U); // of a hundred
  EXPECT_TRUE(has(heard.back(), "stop"));
  on.cycle(); // the pong; the rest follows
  EXPECT_FALSE(p.hear_after(1).empty());
}

TEST_F(core_credit, needs_no_cycles_while_it_waits_for_a_pong) {
  viewer();
  saturate();
  on.cycle();
  EXPECT_GT(on.next_wake, on.now);
}

TEST_F(core_credit, loses_nothing_to_a_reader_that_is_slow_but_reads) {
  peer& p = viewer();
  saturate();
  std::size_t heard = 0;
  for (int i = 0; i < 2000; ++i) {
    heard += p.hear(100).size();
    on.cycle();
  }
  EXPECT_EQ(heard, 100U);
  EXPECT_EQ(on.count(counter::messages_out), 100U);
}

TEST_F(core_credit, counts_a_peer_that_answers_neither_of_two_pings_until_it_does) {
  peer& p = viewer();
  saturate();
  on.cycle(500ms);
  EXPECT_EQ(on.count(counter::slow_peers), 0U);
  on.cycles(3, 500ms);
  EXPECT_EQ(on.count(counter::slow_peers), 1U);
  on.cycles(2, 500ms);
  EXPECT_EQ(on.count(counter::slow_peers), 1U);
  for (int i = 0; i < 3; ++i) { // the last of these round trips is short
    (void)p.hear();
    on.cycle();
  }
  on.cycles(14, 500ms); // silence, by now
  EXPECT_EQ(on.count(counter::slow_peers), 2U);
}

TEST_F(core_credit, tells_the_transport_how_large_a_buffer_suits_who_has_a_low_rtt) {
  peer& p = viewer();
  saturate();
  (void)p.hear();
  on.cycle(1ms);
  EXPECT_GE(on.net.send_buffer(p.id()), rowe::service::credit::send_buffer_min);
  peer& far = viewer();
  saturate();
  (void)far.hear();
  on.cycle(2ms);
  EXPECT_EQ(on.net.send_buffer(far.id()), 0U);
}

TEST_F(core_credit, begins_a_frame_while_there_is_any_credit_and_no_other_behind_it) {
  auto& large = on.offer(rowe::detail::pair_kind::publish_text, "/telemetry", 8000, {.depth = 2});
  peer& p = viewer();
  for (int i = 0; i < 8; ++i) {
    (void)publish_text(on, large,
                       R"({"x":")" + std::string(7000, 'x') + "\"}"); // what finds no slot is counted
    on.cycle();
  }
  EXPECT_GE(on.net.sent(p.id()).size(), credit::bytes_min);
  EXPECT_LE(on.net.sent(p.id()).size(), credit::bytes_min + 7100);
}

// Its kernel takes what we write, so no write is ever refused; and it is never silent.
TEST_F(core_credit, cuts_a_peer_that_talks_but_neither_reads_nor_answers) {
  peer& p = viewer();
  p.answers_pings = false;
  saturate();
  for (int i = 0; i < 15; ++i) { // of silence_max, twice 8 s
    p.send(rowe::wire::opcode::ping, "I am here");
    on.cycle(1s);
    EXPECT_FALSE(p.cut()) << i;
  }
  for (int i = 0; i < 3; ++i) {
    p.send(rowe::wire::opcode::pong, "anything else");
    on.cycle(1s);
  }
  EXPECT_TRUE(p.cut());
  EXPECT_EQ(on.count(counter::stalled_peers), 1U);
  EXPECT_EQ(on.count(counter::silent_peers), 0U);
}

TEST_F(core_credit, keeps_a_peer_that_answers_late_but_answers) {
  peer& p = viewer();
  saturate();
  for (int i = 0; i < 10; ++i) {
    for (int second = 0; second < 14; ++second) {
      p.send(rowe::wire::opcode::ping, "I am here");
      on.cycle(1s);
    }
    (void)p.hear();
    on.cycle();
    ASSERT_FALSE(p.cut()) << i;
  }
}

TEST_F(core_credit, puts_no_ping_into_a_short_exchange) {
  peer p{on};
  EXPECT_EQ(p.ask(R"({"op":"subscribe","topic":"no slash?","throttle_rate":"x"})").size(), 1U);
  on.cycles(2, 500ms);
  (void)p.hear();
  EXPECT_EQ(p.pings, 0);
}

TEST_F(core_credit_hop, keeps_a_peer_that_talks_and_answers_no_pings) {
  peer& p = viewer();
  p.answers_pings = false;
  saturate();
  for (int i = 0; i < 40; ++i) {
    p.say(R"({"a":1})");
    on.cycle(1s);
  }
  EXPECT_FALSE(p.cut());
}

TEST_F(core_credit_hop, neither_pings_nor_bounds) {
  peer& p = viewer();
  saturate();
  EXPECT_EQ(p.hear().size(), 100U);
  on.cycles(20, 500ms);
  (void)p.hear();
  EXPECT_EQ(p.pings, 0);
}

} // namespace
} // namespace core_credit_test
} // namespace harness
