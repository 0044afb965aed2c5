// SPDX-License-Identifier: Apache-2.0
#include "service/requests/dispatcher.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "service/core/all_parts.hpp"
#include "json/padded.hpp"

namespace dispatcher_test {
namespace {

using namespace all_parts;

struct dispatcher_test : all_parts::all_parts {
  explicit dispatcher_test(rowe::service::side of = rowe::service::side::server)
      : all_parts{::state_fixture::with({.connections_max = 3, .door_slots = 4, .handles_max = 1}), of} {}

  void say(const connection& by, std::string_view text, bool again = false) {
    rowe::tests::padded said{text};
    const auto bytes = std::as_writable_bytes(said.bytes());
    again ? parts.dispatcher_.dispatch_again({by.id.index}, bytes, false)
          : parts.dispatcher_.dispatch({by.id.index}, bytes, false);
  }
};
struct dispatcher_of_client : dispatcher_test {
  dispatcher_of_client() : dispatcher_test{rowe::service::side::client} {}
};

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
