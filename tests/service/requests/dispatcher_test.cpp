// SPDX-License-Identifier: Apache-2.0
#include "service/requests/dispatcher.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/core/all_parts.hpp"
#include "json/padded.hpp"

namespace dispatcher_test {
namespace {

using namespace all_parts;

constexpr std::string_view stop = R"({"op":"call_service","id":"1","service":"/rowe/stop"})";

struct dispatcher_test : all_parts::all_parts {
  explicit dispatcher_test(rowe::service::side of = rowe::service::side::server)
      : all_parts{::state_fixture::with({.connections_max = 3, .door_slots = 4, .lanes_max = 1}), of} {}

  rowe::detail::latch_words<> words;

  void add_loop() { (void)parts.stop_rules_.add_loop("loop", 1s, words, cycle.now); }
  static std::span<std::byte> bytes(rowe::tests::padded& text) {
    return std::as_writable_bytes(text.bytes());
  }
  void say(const connection& by, std::string_view text, bool again = false) {
    rowe::tests::padded said{text};
    again ? parts.dispatcher_.dispatch_again({by.id.index}, bytes(said), false)
          : parts.dispatcher_.dispatch({by.id.index}, bytes(said), false);
  }
  bool is_stop(const connection& by, std::string_view text) {
    rowe::tests::padded said{text};
    return parts.dispatcher_.is_stop({by.id.index}, bytes(said), false);
  }
  std::uint64_t stops() const { return counts.read(counter::stops); }
};
struct dispatcher_of_client : dispatcher_test {
  dispatcher_of_client() : dispatcher_test{rowe::service::side::client} {}
};

TEST_F(dispatcher_test, says_whether_a_text_is_a_stop_and_carries_out_nothing) {
  connection& peer = connect();
  EXPECT_FALSE(is_stop(peer, stop)) << "there is nothing to stop";
  add_loop();
  EXPECT_TRUE(is_stop(peer, stop));
  EXPECT_FALSE(is_stop(peer, R"({"op":"call_service","id":"1","service":"/rowe/stop/state"})"));
  EXPECT_FALSE(is_stop(peer, R"({"op":"subscribe","topic":"/rowe/stop/state"})"));
  EXPECT_FALSE(is_stop(peer, "{"));
  EXPECT_EQ(stops(), 0U);
  EXPECT_EQ(counts.read(counter::messages_in), 0U);
  EXPECT_EQ(state.subscriptions.count(), 0U);
}

TEST_F(dispatcher_test, parks_a_message_without_room_and_counts_it_once) {
  connection& peer = connect();
  (void)threads_inbox.try_receive(cycle.now); // there is a receiver, which takes nothing
  std::uint64_t said = 0;
  for (; !peer.unheard && said < 20; ++said) say(peer, R"({"n":1})");
  ASSERT_TRUE(peer.unheard);
  EXPECT_EQ(counts.read(counter::messages_in), said);
  const auto slot = threads_inbox.try_receive(cycle.now);
  ASSERT_TRUE(slot);
  (void)threads_inbox.release(*slot); // nobody waits
  say(peer, R"({"n":1})", true);
  EXPECT_EQ(counts.read(counter::messages_in), said);
  EXPECT_EQ(peer.messages_in, said);
  parts.ingress_.forget({peer.id.index});
}

TEST_F(dispatcher_test, reports_statuses_of_a_peer_up_to_their_rate) {
  connection& peer = connect();
  constexpr int burst = rowe::service::refusal_events_burst;
  for (int i = 0; i < burst + 3; ++i) say(peer, R"({"op":"status","level":"error","msg":"a\tb"})");
  const auto happened = events();
  ASSERT_EQ(happened.size(), std::size_t{burst});
  EXPECT_EQ(happened[0].what_kind, rowe::event::kind::status_from_peer);
  EXPECT_EQ(std::string_view{happened[0].what}, "a\tb");
  EXPECT_EQ(counts.read(counter::events_lost), 3U);
}

// The two ends might refuse each other's refusals for ever.
TEST_F(dispatcher_of_client, counts_what_a_server_must_not_ask_and_does_not_answer) {
  connection& server = connect();
  say(server, R"({"op":"subscribe","topic":"/odom"})");
  say(server, R"({"op":"advertise_service","service":"/add"})");
  say(server, R"({"op":"no_such_thing"})");
  EXPECT_GE(counts.read(counter::refused_requests), 2U);
  EXPECT_EQ(hear(server), "");
  EXPECT_FALSE(state.topics.find("/odom"));
}

} // namespace
} // namespace dispatcher_test
