// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/liveness.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/incoming/reading_parts.hpp"

namespace liveness_test {
namespace {

using namespace reading_parts;

rowe::endpoint_options impatient() {
  rowe::endpoint_options options;
  options.limits.connections_max = 4;
  options.limits.handles_max = 1;
  options.ping_period = 3s;
  options.silence_max = 8s;
  options.message_time_max = 5s;
  return options;
}

struct liveness_test : reading_parts::reading_parts {
  liveness_test() : reading_parts{impatient()} {}

  rowe::service::long_ingress pieces{memory, state};
  rowe::service::fragment_ingress fragments{
      memory, {.state_ = state, .outbox_ = out, .refusals_ = refused, .long_ingress_ = pieces}};
  rowe::service::liveness checks{{.state_ = state,
                                  .outbox_ = out,
                                  .sender_ = sending,
                                  .refusals_ = refused,
                                  .ingress_ = in,
                                  .fragment_ingress_ = fragments}};
  connection& peer = begin();

  int checked = 0;  // how often a peer was
  std::string sent; // to the peer

  connection& begin() {
    connection& c = arrive();
    checks.open({c.id.index});
    return c;
  }
  // As cycles do.
  void step(rowe::rt::duration by = 10ms) {
    cycle.now += by;
    while (const auto one = due.take_due(cycle.now)) {
      if (one->what != rowe::service::timer::peer) continue;
      checks.check({one->index});
      ++checked;
    }
    sending.flush_all();
    sent += arrived(peer);
  }
  void pass(rowe::rt::duration time) {
    for (const auto end = cycle.now + time; cycle.now < end;) step();
  }
  // How many frames of a kind were written to the peer since the last look.
  int written(opcode what) {
    int count = 0;
    const std::string bytes = std::exchange(sent, {});
    for (std::size_t at = 0; at < bytes.size();) {
      const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
      count += (byte(at) & 15U) == static_cast<unsigned>(what);
      at += 2U + byte(at + 1); // control frames of a server
    }
    return count;
  }
  // The peer says something, but answers no ping.
  void hear() { peer.heard_at = cycle.now; }
};

TEST_F(liveness_test, is_checked_twice_a_second_until_the_peer_closes) {
  pass(10s - 500ms);
  EXPECT_FALSE(peer.open());
  const int before = checked;
  EXPECT_GE(before, 16);
  EXPECT_LE(before, 2 * 10);
  pass(3s);
  EXPECT_LE(checked, before + 1);
}

// A thousand quiet peers must not wake the thread two thousand times a second.
TEST_F(liveness_test, of_many_peers_is_due_at_the_same_time) {
  cycle.now += rowe::rt::duration{1};
  (void)begin();
  cycle.now += 2ms;
  (void)begin();
  while (checked == 0) step(100us);
  EXPECT_EQ(checked, 3);
}

TEST_F(liveness_test, asks_a_silent_peer_and_closes_it_if_it_stays_silent) {
  pass(2900ms);
  EXPECT_EQ(written(opcode::ping), 0);
  pass(1s);
  EXPECT_GE(written(opcode::ping), 1);
  pass(4s);
  EXPECT_TRUE(peer.open());
  pass(1s);
  EXPECT_FALSE(peer.open());
  EXPECT_EQ(peer.close_reason, "nothing was heard for too long");
  EXPECT_EQ(counts.read(counter::silent_peers), 1U);
  EXPECT_EQ(counts.read(counter::stalled_peers), 0U);
}

TEST_F(liveness_test, says_of_a_silent_peer_for_which_messages_wait_that_it_does_not_read) {
  pass(7s);
  ASSERT_TRUE(peer.open());
  EXPECT_EQ(counts.read(counter::slow_peers), 1U) << "two pings are unanswered";
  out.of({peer.id.index}).out_of_credit = true;
  cycle.now += 2s;
  checks.check({peer.id.index});
  EXPECT_FALSE(peer.open());
  EXPECT_EQ(peer.close_reason, "the peer does not read");
  EXPECT_EQ(counts.read(counter::stalled_peers), 1U);
  EXPECT_EQ(counts.read(counter::silent_peers), 0U);
}

TEST_F(liveness_test, says_that_a_peer_does_not_read_only_if_it_was_asked) {
  out.of({peer.id.index}).out_of_credit = true;
  cycle.now += 9s;
  checks.check({peer.id.index});
  EXPECT_EQ(peer.close_reason, "nothing was heard for too long");
}

TEST_F(liveness_test, closes_a_peer_that_talks_and_answers_no_ping) {
  pass(4s);
  ASSERT_GE(written(opcode::ping), 1);
  const auto asked = sending.urgent().waits_for_pong_since({peer.id.index});
  while (cycle.now < asked + rowe::service::silences_unanswered_max * options.silence_max) {
    ASSERT_TRUE(peer.open());
    hear();
    step();
  }
  for (int i = 0; i < 100; ++i, hear()) step();
  EXPECT_FALSE(peer.open());
  EXPECT_EQ(peer.close_reason, "the peer does not answer pings");
  EXPECT_EQ(counts.read(counter::stalled_peers), 1U);
}

// Its pongs lie behind what we do not read.
TEST_F(liveness_test, takes_no_peer_for_silent_that_is_not_read) {
  pass(4s); // a ping is under way
  (void)written(opcode::ping);
  peer.unheard = true;
  pass(40s);
  EXPECT_TRUE(peer.open());
  EXPECT_GE(written(opcode::pong), 10) << "it must know that we are alive";
  EXPECT_EQ(counts.read(counter::slow_peers), 0U);
  peer.unheard = false; // as ingress says it
  peer.heard_at = peer.unheard_until = cycle.now;
  pass(2s);
  EXPECT_TRUE(peer.open()) << "it has time to answer";
  for (int i = 0; i < 1600; ++i, hear()) step();
  EXPECT_FALSE(peer.open()) << "but not for ever";
}

// Whether a receiver is absent depends on the time alone.
TEST_F(liveness_test, lets_what_is_parked_be_tried_again) {
  pass(600ms);
  const auto before = cycle.places_freed;
  pass(1s);
  EXPECT_EQ(cycle.places_freed, before);
  peer.unheard = true;
  pass(1s);
  EXPECT_GT(cycle.places_freed, before);
}

TEST_F(liveness_test, gives_each_message_its_own_time) {
  for (int i = 0; i < 3; ++i) {
    read(peer, frame("{", opcode::text, false));
    in.read_in_turn();
    for (int k = 0; k < 400; ++k, hear()) step();
    read(peer, frame("}", opcode::continuation));
    in.read_in_turn();
  }
  EXPECT_TRUE(peer.open());
  EXPECT_EQ(handler.heard.size(), 3U);
}

TEST_F(liveness_test, asks_nothing_of_peers_that_know_no_pings) {
  const auto& hop = rowe::wire::protocols_of(rowe::websocket_profile::hop);
  ASSERT_FALSE(hop.find({}).can.control_frames);
  peer.protocol = &hop.find({});
  sending.open({peer.id.index});
  pass(60s);
  EXPECT_TRUE(peer.open());
  EXPECT_EQ(sent, "");
  read(peer, frame("{", opcode::text, false));
  in.read_in_turn();
  pass(6s);
  EXPECT_FALSE(peer.open()) << "but what they begin they have to finish";
}

} // namespace
} // namespace liveness_test
