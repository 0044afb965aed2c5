// SPDX-License-Identifier: Apache-2.0
// What ends with a connection, and with a run of an endpoint: nothing that was said before is delivered, done
// or answered behind it.
#include "core_fixtures.hpp"

namespace core_epochs_test {
namespace {

using namespace harness;
using rowe::detail::pair_kind;
using rowe::service::side;

std::string member(std::string_view text, std::string_view name) {
  const auto at = text.find("\"" + std::string{name} + "\":");
  if (at == std::string_view::npos) return {};
  const auto from = at + name.size() + 3;
  return std::string{text.substr(from, text.find_first_of(",}", from) - from)};
}

struct clients_epochs : core_test {
  clients_epochs() : core_test{small_options(), side::client} {}
  // Until the next attempt to connect.
  void wait_for_attempt() {
    const auto before = on.net.attempts();
    while (on.net.attempts() == before) on.cycle();
  }
};

TEST_F(clients_epochs, end_what_handles_had_published_and_nobody_had_taken) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/out", 100, {.depth = 32});
  peer server{on, side::client};
  on.cycle();
  on.net.link_of(server.id()).capacity_bytes = 0;
  std::uint64_t accepted = 0;
  while (publish_text(on, pair, R"({"n":1})")) {
    ++accepted;
    on.cycle();
  }
  ASSERT_EQ(accepted, 48U) << "some wait in the queue to the server, and some in the handle's own";
  server.leave(rowe::service::close_cause::reset);
  wait_for_attempt();
  EXPECT_EQ(on.count(counter::lost_with_peer), 16U);
  EXPECT_EQ(on.count(counter::no_peer), 32U);
  peer again{on, side::client};
  const std::string heard = only(again.hear_after(3));
  EXPECT_TRUE(has(heard, R"("op":"advertise")"));
}

TEST_F(clients_epochs, begin_with_what_handles_keep_latched) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/map", 100, {.ttl = 10s, .latched = true});
  for (int i = 1; i <= 2; ++i) {
    peer server{on, side::client, "127.0.0.1:9", "/", "rowe.v1"};
    const texts heard = server.hear_after(2);
    ASSERT_EQ(heard.size(), i == 1 ? 1U : 2U) << "nobody has published yet";
    if (i == 2) {
      EXPECT_TRUE(has(heard[1], R"("topic":"/map","msg":{"n":1})"));
      EXPECT_LT(std::stod(member(heard[1], "ttl_ms")), 10'000.0 - 187) << "less the time without a server";
    }
    if (i == 1) {
      ASSERT_TRUE(publish_text(on, pair, R"({"n":1})"));
    }
    EXPECT_EQ(server.hear_after(1).size(), i == 1 ? 1U : 0U);
    server.leave(rowe::service::close_cause::reset);
    wait_for_attempt();
  }
  on.cycles(10'001);
  peer late{on, side::client};
  EXPECT_EQ(late.hear_after(2).size(), 1U) << "its time is over";
}

TEST_F(clients_epochs, end_plain_messages_when_their_time_is_over) {
  peer server{on, side::client};
  on.cycle();
  on.net.link_of(server.id()).capacity_bytes = 0;
  const auto send = [&](std::string_view text, rowe::duration ttl) {
    ASSERT_TRUE(on.submissions.submit({.what = rowe::detail::entry::message,
                                       .stamped = on.now,
                                       .expires = rowe::rt::deadline_after(on.now, ttl)},
                                      text));
    on.cycle();
  };
  send(R"({"drive":1})", 50ms);
  send(R"({"tell":2})", 60s);
  server.leave(rowe::service::close_cause::reset);
  wait_for_attempt();
  peer again{on, side::client};
  const std::string heard = only(again.hear_after(2));
  EXPECT_EQ(member(heard, "tell"), "2");
  EXPECT_LT(std::stod(member(heard, "ttl_ms")), 60'000.0 - 187) << "less the time without a server";
  EXPECT_EQ(on.count(counter::expired), 1U);
}

TEST_F(clients_epochs, give_handles_the_latched_value_of_the_new_server_only) {
  auto& pair = on.offer_now(pair_kind::subscribe_text, "/map", 100);
  {
    peer server{on, side::client};
    server.tell(R"({"op":"publish","topic":"/map","msg":{"of":"old"},"latch":true})", 2);
    EXPECT_EQ(take(pair).value(), R"({"of":"old"})");
    server.leave();
    on.cycle();
  }
  auto& late = on.offer(pair_kind::subscribe_text, "/map", 100);
  on.cycles(2);
  EXPECT_EQ(take(late).code(), rowe::errc::empty) << "what the old server said is kept for nobody";
  wait_for_attempt();
  peer again{on, side::client};
  on.cycles(2);
  EXPECT_EQ(take(late).code(), rowe::errc::empty);
  again.tell(R"({"op":"publish","topic":"/map","msg":{"of":"new"}})");
  EXPECT_EQ(take(late).value(), R"({"of":"new"})");
}

// A peer that comes again gets nothing that was queued for it before, and what it said half is forgotten.
TEST_F(core_test, ends_with_a_connection_what_was_queued_for_it_and_what_it_had_said_in_part) {
  auto& pair = advertise_pose(on);
  peer first = subscriber(on, "/pose");
  on.net.link_of(first.id()).capacity_bytes = 5;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  on.cycle();
  const std::array begun{std::byte{0x81}, std::byte{0xff}}; // the header of a long text
  first.send_raw(begun);
  on.cycle();
  first.leave(rowe::service::close_cause::reset);
  on.cycle();
  EXPECT_EQ(on.count(counter::lost_with_peer), 3U);
  peer second{on};
  EXPECT_EQ(second.id().index, first.id().index) << "it has the place of the first";
  second.tell(R"({"op":"subscribe","topic":"/pose"})");
  ASSERT_TRUE(publish(on, pair, {7, 0}));
  EXPECT_EQ(second.hear_after(1), texts{message(7)});
}

struct robot_runs : testing::Test {
  static rowe::endpoint_options options() {
    auto chosen = small_options();
    chosen.stop.unguarded = true;
    return chosen;
  }
  // One run of a robot with a stop.
  struct run {
    explicit run(std::uint64_t seed) : on{options(), side::server, seed} {
      on.offer_now(rowe::detail::latch_request({.name = "base"}));
    }
    std::string ask(const std::string& service, const std::string& args) {
      peer by{on};
      on.cycle();
      by.tell(R"({"op":"call_service","id":"c","service":")" + service + R"(","args":)" + args + "}", 2);
      const texts heard = by.hear();
      by.leave();
      on.cycle();
      return heard.empty() ? std::string{} : heard.back();
    }
    core_harness on;
  };
};

TEST_F(robot_runs, are_told_apart_by_their_epoch) {
  run first{1};
  run second{2};
  const std::string epoch = member(first.ask("/rowe/stats", "{}"), "epoch");
  EXPECT_EQ(epoch.size(), 18U) << epoch;
  EXPECT_EQ(member(first.ask("/rowe/stats", "{}"), "epoch"), epoch) << "a peer has come again, not the robot";
  EXPECT_NE(member(second.ask("/rowe/stats", "{}"), "epoch"), epoch);
}

TEST_F(robot_runs, refuse_a_reset_and_a_heartbeat_that_were_meant_for_the_run_before) {
  run before{1};
  const std::string old = before.ask("/rowe/stop/state", "{}");
  const std::string number = member(old, "number");
  const std::string tick = member(old, "tick");
  run after{2};
  const std::string now = after.ask("/rowe/stop/state", "{}");
  ASSERT_NE(member(now, "number"), number);
  for (const std::string& named : {number, member(now, "number")}) {
    const std::string answer =
        after.ask("/rowe/stop/reset", R"({"number":)" + named + R"(,"tick":)" + tick + "}");
    EXPECT_NE(member(answer, "refused"), "null") << answer;
    EXPECT_EQ(member(answer, "state"), "\"stopped\"") << answer;
  }
  const std::string heartbeat = after.ask("/rowe/stop/guard", R"({"guard":"pad","tick":)" + tick + "}");
  EXPECT_EQ(member(heartbeat, "refused"), "\"tick\"") << heartbeat;
}

} // namespace
} // namespace core_epochs_test
