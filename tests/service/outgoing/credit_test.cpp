// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/credit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace credit_test {
namespace {

using namespace std::chrono_literals;
using rowe::priority;
using rowe::rt::duration;
using rowe::rt::time_point;
using rowe::service::credit;

constexpr std::size_t frame_bytes = 22; // of a ping

// What the core does with a credit, and a peer that answers when told to.
struct credit_test : testing::Test {
  credit_test() { of.begin(0x1234); }

  std::size_t room() const { return of.room(priority::normal); }
  void write(std::size_t bytes) { of.wrote(bytes, now); }
  // Writes a ping if one is wanted.
  bool ping() {
    if (!of.wants_ping(now)) return false;
    asked.push_back(of.ping(frame_bytes, now));
    of.wrote(frame_bytes, now);
    return true;
  }
  bool pong() {
    const auto answer = asked.front();
    asked.pop_front();
    return of.take_pong(answer, now);
  }
  // One round trip that takes so long, with so many bytes before the ping.
  void round(std::size_t bytes, duration took) {
    write(bytes);
    ASSERT_TRUE(ping());
    now += took;
    ASSERT_TRUE(pong());
  }

  credit of;
  time_point now{1000s};
  std::deque<credit::ping_payload> asked;
};

TEST_F(credit_test, sets_no_bound_before_it_is_begun) {
  const credit hop;
  EXPECT_EQ(hop.room(priority::bulk), SIZE_MAX);
  EXPECT_FALSE(hop.wants_ping(now));
}

TEST_F(credit_test, pings_first_behind_a_kibibyte_so_that_short_exchanges_have_none) {
  EXPECT_EQ(room(), 1024U + 2048U);
  write(1000);
  EXPECT_FALSE(ping());
  write(24);
  EXPECT_EQ(room(), 2048U); // what is written together with it goes with it
  EXPECT_TRUE(ping());
  EXPECT_EQ(room(), credit::bytes_min - 1024 - frame_bytes);
}

TEST_F(credit_test, asks_one_at_a_time_and_again_in_the_middle_of_the_bound) {
  round(1024, 1ms);
  EXPECT_EQ(of.in_flight(), 0U);
  EXPECT_EQ(room(), credit::bytes_min_low_rtt / 2 + 2048);
  write(credit::bytes_min_low_rtt / 2);
  EXPECT_TRUE(ping());
  EXPECT_FALSE(ping());
  EXPECT_EQ(room(), credit::bytes_min_low_rtt / 2 - frame_bytes);
  write(room());
  EXPECT_EQ(room(), 0U);
  now += 1ms;
  EXPECT_TRUE(pong());
  EXPECT_EQ(of.in_flight(), credit::bytes_min_low_rtt / 2 - frame_bytes);
}

TEST_F(credit_test, has_room_for_what_is_urgent_when_there_is_none_for_the_rest) {
  round(1024, 1ms);
  write(credit::bytes_min_low_rtt);
  EXPECT_EQ(room(), 0U);
  EXPECT_EQ(of.room(priority::urgent), credit::bytes_min_low_rtt);
  write(credit::bytes_min_low_rtt);
  EXPECT_EQ(of.room(priority::urgent), 0U);
}

TEST_F(credit_test, ignores_pongs_that_answer_nothing_it_asked) {
  write(1024);
  ASSERT_TRUE(ping());
  auto answer = asked.front();
  EXPECT_FALSE(of.take_pong({}, now));
  EXPECT_FALSE(of.take_pong(std::span{answer}.first(8), now));
  answer[15] ^= std::byte{1};
  EXPECT_FALSE(of.take_pong(answer, now)); // another nonce
  answer = asked.front();
  answer[0] ^= std::byte{1};
  EXPECT_FALSE(of.take_pong(answer, now)); // other bytes
  EXPECT_EQ(of.in_flight(), 1024 + frame_bytes);
  answer = asked.front();
  EXPECT_TRUE(pong());
  EXPECT_FALSE(of.take_pong(answer, now)); // a second time
}

TEST_F(credit_test, believes_no_pong_to_a_ping_that_is_not_written_yet) {
  write(1024);
  const auto early = of.ping(frame_bytes, now);
  EXPECT_FALSE(of.take_pong(early, now));
  of.wrote(frame_bytes, now);
  EXPECT_TRUE(of.take_pong(early, now));
}

TEST_F(credit_test, allows_what_is_read_in_two_round_trips_and_20_ms) {
  round(1024, 10ms); // measures the way
  round(8192, 10ms);
  EXPECT_NEAR(static_cast<double>(of.bound()), (8192 + frame_bytes) / 0.010 * 0.040, 1);
}

TEST_F(credit_test, stays_between_12_kib_and_1_mib) {
  round(1024, 2ms);
  for (int i = 0; i < 20; ++i) round(of.bound(), 2ms);
  EXPECT_EQ(of.bound(), credit::bytes_max);
  for (int i = 0; i < 20; ++i) round(of.bound(), 60s);
  EXPECT_EQ(of.bound(), credit::bytes_min);
}

TEST_F(credit_test, stays_between_8_and_256_kib_where_the_round_trip_is_short) {
  round(1024, 100us);
  for (int i = 0; i < 20; ++i) round(of.bound(), 100us);
  EXPECT_EQ(of.bound(), credit::bytes_max_low_rtt);
  for (int i = 0; i < 20; ++i) round(of.bound(), 60s);
  EXPECT_EQ(of.bound(), credit::bytes_min_low_rtt);
}

TEST_F(credit_test, shrinks_at_the_first_pong_of_a_reader_that_became_slow) {
  round(1024, 100us);
  for (int i = 0; i < 20; ++i) round(of.bound(), 100us);
  ASSERT_EQ(of.bound(), credit::bytes_max_low_rtt);
  round(credit::bytes_max_low_rtt / 2, 130ms); // 1 MB a second
  EXPECT_EQ(of.bound(), credit::bytes_min_low_rtt);
}

TEST_F(credit_test, wants_a_send_buffer_in_steps_and_only_where_the_round_trip_is_short) {
  std::size_t buffer = 0;
  // A round with as much behind the ping as before it.
  const auto step = [&](std::size_t bytes, duration took) {
    write(bytes);
    ASSERT_TRUE(ping());
    write(bytes);
    now += took;
    ASSERT_TRUE(pong());
    buffer = of.send_buffer(buffer);
  };
  step(1024, 2ms);
  EXPECT_EQ(buffer, 0U);
  of.begin(0x1234); // another peer
  step(1024, 100us);
  EXPECT_EQ(buffer, credit::send_buffer_min);
  for (int i = 0; i < 20; ++i) {
    step(of.bound() / 2, 100us);
    EXPECT_GE(buffer, of.bound());
    EXPECT_LE(buffer, std::max(4 * of.bound(), credit::send_buffer_min));
  }
  EXPECT_EQ(buffer, credit::bytes_max_low_rtt);
  step(of.bound() / 2, 60s);
  EXPECT_EQ(buffer, credit::send_buffer_min);
}

TEST_F(credit_test, wants_no_larger_send_buffer_while_little_is_in_flight) {
  round(1024, 100us);
  std::size_t buffer = of.send_buffer(0);
  for (int i = 0; i < 20; ++i) {
    round(of.bound() / 2, 100us);
    buffer = of.send_buffer(buffer);
  }
  EXPECT_GT(of.bound(), credit::send_buffer_min);
  EXPECT_EQ(buffer, credit::send_buffer_min);
}

TEST_F(credit_test, keeps_its_bound_while_less_is_written_than_could_be) {
  round(1024, 1ms);
  for (int i = 0; i < 5; ++i) round(of.bound(), 1ms);
  const std::size_t bound = of.bound();
  for (int i = 0; i < 100; ++i) { // the same bytes, but one millisecond in ten
    now += 9ms;
    round(of.bound() / 2, 1ms);
  }
  EXPECT_GE(of.bound(), bound);
}

TEST_F(credit_test, asks_once_more_and_then_calls_the_peer_slow) {
  round(1024, 10ms);
  write(credit::bytes_min);
  ASSERT_TRUE(ping());
  now += 120ms; // two round trips and 100 ms
  EXPECT_FALSE(ping());
  now += 1ms;
  EXPECT_TRUE(ping());
  EXPECT_FALSE(of.unresponsive(now));
  now += 121ms;
  EXPECT_FALSE(ping());
  EXPECT_TRUE(of.unresponsive(now));
  asked.pop_front(); // a peer may answer the latest only
  EXPECT_TRUE(pong());
  EXPECT_FALSE(of.unresponsive(now));
  EXPECT_EQ(of.in_flight(), 0U);
}

TEST_F(credit_test, does_not_believe_that_what_lies_between_two_pongs_was_read_in_no_time) {
  round(1024, 1ms);
  write(8192);
  ASSERT_TRUE(ping());
  write(8192);
  now += 500ms;
  ASSERT_TRUE(ping());
  now += 500ms;
  ASSERT_TRUE(pong());
  ASSERT_TRUE(pong());
  EXPECT_EQ(of.bound(), credit::bytes_min_low_rtt);
}

TEST_F(credit_test, takes_a_late_pong_for_what_it_acknowledges) {
  round(1024, 10ms);
  write(credit::bytes_min);
  ASSERT_TRUE(ping());
  write(100);
  now += 121ms;
  ASSERT_TRUE(ping());
  EXPECT_TRUE(pong());
  EXPECT_EQ(of.in_flight(), 100U + frame_bytes);
  EXPECT_TRUE(of.ping_under_way());
  EXPECT_TRUE(pong());
  EXPECT_EQ(of.in_flight(), 0U);
}

TEST_F(credit_test, asks_whether_a_silent_peer_is_alive) {
  EXPECT_FALSE(ping());
  of.ask();
  EXPECT_TRUE(ping());
  EXPECT_FALSE(ping());
}

TEST_F(credit_test, knows_who_has_a_low_rtt) {
  EXPECT_FALSE(of.low_rtt());
  round(1024, 2ms);
  EXPECT_FALSE(of.low_rtt());
  round(8192, 1999us);
  EXPECT_TRUE(of.low_rtt());
}

TEST_F(credit_test, keeps_the_shortest_way_while_nothing_is_held_back) {
  round(1024, 1ms);
  for (int i = 0; i < 100; ++i) {
    now += 1s;
    round(of.bound() / 2, 50ms);
  }
  EXPECT_TRUE(of.low_rtt()); // 1 ms
}

TEST_F(credit_test, measures_the_way_anew_where_there_is_always_a_queue_and_nothing_else_does) {
  round(1024, 1ms);
  int measured = 0;
  for (int i = 0; i < 10'000; ++i) {
    if (of.settling()) {
      EXPECT_EQ(room(), 0U);
      EXPECT_GT(of.room(priority::urgent), 0U);
      ASSERT_TRUE(ping());
      now += of.in_flight() > frame_bytes ? 21ms : 1ms;
      measured += of.in_flight() <= frame_bytes;
    } else {
      write(of.bound() / 2);
      ASSERT_TRUE(ping());
      write(room());
      of.held_back();
      now += 21ms;
    }
    ASSERT_TRUE(pong());
  }
  EXPECT_GT(measured, 5);
  EXPECT_TRUE(of.low_rtt()); // 1 ms
}

TEST_F(credit_test, takes_a_late_answer_of_an_idle_peer_for_no_rate) {
  round(1024, 100us);
  for (int i = 0; i < 20; ++i) round(of.bound(), 100us);
  ASSERT_EQ(of.bound(), credit::bytes_max_low_rtt);
  for (int i = 0; i < 5; ++i) {
    now += 3s;
    of.ask(); // whether it is alive
    round(0, 8ms);
  }
  EXPECT_EQ(of.bound(), credit::bytes_max_low_rtt);
}

// Round trips with a queue of ours, until nothing is in flight and a lone ping is next.
void drain(credit_test& with) {
  while (!with.of.settling()) {
    with.write(with.of.bound() / 2);
    ASSERT_TRUE(with.ping());
    with.write(with.room());
    with.of.held_back();
    with.now += 121ms;
    ASSERT_TRUE(with.pong());
  }
  ASSERT_TRUE(with.ping());
  with.now += 121ms;
  ASSERT_TRUE(with.pong());
  ASSERT_TRUE(with.of.settling());
}

TEST_F(credit_test, asks_a_low_rtt_peer_again_where_one_lone_answer_is_late) {
  round(1024, 1ms);
  drain(*this);
  round(0, 5ms); // other load
  EXPECT_TRUE(of.settling());
  EXPECT_EQ(room(), 0U);
  round(0, 1ms);
  EXPECT_FALSE(of.settling());
  EXPECT_TRUE(of.low_rtt());
}

TEST_F(credit_test, believes_three_late_answers_of_a_low_rtt_peer_and_takes_the_shortest) {
  round(1024, 1ms);
  drain(*this);
  round(0, 9ms);
  round(0, 5ms);
  EXPECT_TRUE(of.settling());
  round(0, 7ms);
  EXPECT_FALSE(of.settling());
  EXPECT_FALSE(of.low_rtt());
}

TEST_F(credit_test, asks_again_where_a_round_trip_is_a_little_too_long_to_count_as_low) {
  round(1024, 3ms); // other load, from the first ping on
  drain(*this);
  round(0, 4ms);
  EXPECT_TRUE(of.settling());
  round(0, 1ms);
  EXPECT_FALSE(of.settling());
  EXPECT_TRUE(of.low_rtt());
}

TEST_F(credit_test, asks_a_high_rtt_peer_once) {
  round(1024, 50ms);
  drain(*this);
  round(0, 60ms);
  EXPECT_FALSE(of.settling());
}

} // namespace
} // namespace credit_test
