// SPDX-License-Identifier: Apache-2.0
#include "service/requests/dispatcher.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "service/core/all_parts.hpp"
#include "json/padded.hpp"

namespace dispatcher_test {
namespace {

using namespace all_parts;

struct dispatcher_of_client : all_parts::all_parts {
  dispatcher_of_client()
      : all_parts{::state_fixture::with({.connections_max = 3, .door_slots = 4, .lanes_max = 1}),
                  rowe::service::side::client} {}

  void say(const connection& by, std::string_view text) {
    rowe::tests::padded said{text};
    parts.dispatcher_.dispatch({by.id.index}, std::as_writable_bytes(said.bytes()), false);
  }
};

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
