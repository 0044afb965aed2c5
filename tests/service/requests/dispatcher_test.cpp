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
