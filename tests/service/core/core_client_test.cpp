// SPDX-License-Identifier: Apache-2.0
// The core as a client of a rosbridge server.
#include "core_fixtures.hpp"

namespace core_client_test {
namespace {

using namespace harness;
using rowe::detail::pair_kind;
using rowe::service::side;

struct core_client : core_test {
  core_client() : core_test{small_options(), side::client} {}
};

TEST_F(core_client, connects_at_once_and_again_later_each_time_it_is_refused) {
  on.cycle();
  EXPECT_EQ(on.net.attempts(), 1U);
  std::vector<rowe::rt::duration> waits;
  for (std::uint64_t attempt = 2; attempt < 10; ++attempt) {
    on.net.reject("connection refused");
    const auto began = on.now;
    while (on.net.attempts() < attempt) on.cycle();
    waits.push_back(on.now - began);
  }
  EXPECT_GE(waits.front(), 187ms); // retry_min less a quarter
  EXPECT_GE(waits.back(), 3750ms); // retry_max less a quarter
  for (const auto wait : waits) EXPECT_LE(wait, 5002ms);
}

TEST_F(core_client, reports_why_it_cannot_connect) {
  on.cycle();
  on.net.reject("connection refused");
  on.cycle();
  const auto what = on.shared.try_event();
  ASSERT_TRUE(what);
  EXPECT_EQ(what->what_kind, rowe::event::kind::cannot_connect);
  EXPECT_EQ(std::string_view{what->what}, "connection refused");
}

TEST_F(core_client, announces_its_handles_when_it_is_connected_and_masks_its_frames) {
  on.offer(pair_kind::publish_text, "/out", 100, {}, nullptr, "std_msgs/String");
  on.offer(pair_kind::subscribe_text, "/in", 100);
  on.cycle();
  peer server{on, side::client};
  const auto heard = server.hear_after(2);
  EXPECT_EQ(server.violated, ""); // unmasked frames would be
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(has(heard[0], R"("op":"advertise")"));
  EXPECT_TRUE(has(heard[0], R"("type":"std_msgs/String","topic":"/out")"));
  EXPECT_TRUE(has(heard[1], R"("op":"subscribe")"));
}

TEST_F(core_client, tells_its_handles_the_statistics_of_its_server_and_never_its_own) {
  auto& seen = on.offer_now(pair_kind::subscribe_text, "/rowe/stats", 4000);
  peer server{on, side::client};
  EXPECT_EQ(server.hear_after(300).size(), 1U); // that it subscribes
  EXPECT_EQ(take_all(seen), texts{});
  server.tell(R"({"op":"publish","topic":"/rowe/stats","msg":{"name":"hub"}})", 300);
  EXPECT_EQ(take_all(seen), texts{R"({"name":"hub"})"});
}

TEST_F(core_client, tells_its_handles_the_stop_of_its_server_and_never_its_own) {
  on.offer(rowe::detail::latch_request({}));
  auto& seen = on.offer(pair_kind::subscribe_text, "/rowe/stop/state", 4000);
  on.cycle();
  peer server{on, side::client};
  on.cycles(500);
  EXPECT_EQ(take_all(seen), texts{});
  server.tell(R"({"op":"publish","topic":"/rowe/stop/state","msg":{"state":"running"}})", 500);
  EXPECT_EQ(take_all(seen), texts{R"({"state":"running"})"});
}

TEST_F(core_client, announces_a_handle_that_is_opened_while_connected_and_one_that_goes) {
  peer server{on, side::client};
  on.cycle();
  auto& pair = on.offer(pair_kind::publish_text, "/out", 100);
  EXPECT_EQ(server.hear_after(2).size(), 1U);
  ASSERT_TRUE(publish_text(on, pair, "{\"n\":1}"));
  pair.lifecycle.close();
  const auto heard = server.hear_after(3);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_EQ(heard[0], R"({"op":"publish","topic":"/out","msg":{"n":1}})");
  EXPECT_TRUE(has(heard[1], R"("op":"unadvertise")"));
}

TEST_F(core_client, asks_for_as_many_messages_as_the_handle_wants_that_wants_most) {
  const auto in_for = [&](rowe::duration throttle) -> auto& {
    return on.offer(rowe::detail::subscribe_request<rowe::json_text>("/in", {.throttle = throttle}));
  };
  auto& seldom = in_for(1s);
  on.cycle();
  peer server{on, side::client};
  const auto asks_for = [](const texts& heard, const char* ms) {
    return heard.size() == 1 && has(heard[0], "\"op\":\"subscribe\"") &&
           has(heard[0], "\"throttle_rate\":" + std::string{ms} + ",");
  };
  EXPECT_TRUE(asks_for(server.hear_after(2), "1000"));
  auto& more_seldom = in_for(5s);
  EXPECT_EQ(server.hear_after(2), texts{});
  auto& often = in_for(20'900us);
  EXPECT_TRUE(asks_for(server.hear_after(2), "20"));
  often.lifecycle.close();
  EXPECT_TRUE(asks_for(server.hear_after(3), "1000"));
  more_seldom.lifecycle.close();
  EXPECT_EQ(server.hear_after(3), texts{});
  auto& all = in_for(0s);
  EXPECT_TRUE(asks_for(server.hear_after(2), "0"));
  seldom.lifecycle.close();
  EXPECT_EQ(server.hear_after(3), texts{});
  all.lifecycle.close();
  const texts last = server.hear_after(3);
  ASSERT_EQ(last.size(), 1U);
  EXPECT_TRUE(has(last[0], R"("op":"unsubscribe")"));
}

TEST_F(core_client, asks_anew_when_it_is_connected_again) {
  on.offer(rowe::detail::subscribe_request<rowe::json_text>("/in", {.throttle = 1s}));
  on.offer(rowe::detail::subscribe_request<rowe::json_text>("/in", {.throttle = 2s}));
  on.cycle();
  peer server{on, side::client};
  const texts heard = server.hear_after(2);
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_TRUE(has(heard[0], R"("throttle_rate":1000,)"));
}

TEST_F(core_client, continues_a_masked_frame_where_the_socket_stopped_taking_it) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/out", 100);
  peer server{on, side::client};
  (void)server.hear_after(1);
  on.net.link_of(server.id()).capacity_bytes = 5;
  ASSERT_TRUE(publish_text(on, pair, "{\"n\":12345}"));
  ASSERT_TRUE(publish_text(on, pair, "{\"n\":67890}"));
  texts heard = server.hear_during(100);
  EXPECT_EQ(server.violated, "");
  EXPECT_EQ(heard, (texts{R"({"op":"publish","topic":"/out","msg":{"n":12345}})",
                          R"({"op":"publish","topic":"/out","msg":{"n":67890}})"}));
}

TEST_F(core_client, takes_what_the_server_publishes_with_its_text_unchanged) {
  auto& inbox = on.offer_now(pair_kind::subscribe_text, "/in", 100);
  peer server{on, side::client};
  server.tell(R"({"op":"publish","topic":"\/in","msg":{"data":0.1}})", 2);
  const auto slot = inbox.user.in.ring->try_pop();
  ASSERT_TRUE(slot);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(inbox.user.in.memory.value(*slot)),
                        inbox.user.in.memory.header(*slot)->bytes),
            R"({"data":0.1})");
}

TEST_F(core_client, leaves_in_the_queue_pair_what_the_server_does_not_read_so_that_its_publisher_is_told) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/out", 100, {.depth = 32});
  peer server{on, side::client};
  (void)server.hear_after(1);
  on.net.link_of(server.id()).capacity_bytes = 0;
  int accepted = 0;
  for (int i = 0; i < 200; ++i) {
    accepted += rowe::detail::publish_into(pair, 2, on.now, [](std::byte* slot) {
                  std::memcpy(slot, "{}", 2);
                }).has_value();
    on.cycle();
  }
  EXPECT_EQ(accepted, 16 + 32); // queue_depth_max towards the server, and the queue pair's own
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
  on.net.link_of(server.id()).capacity_bytes = 1 << 20;
  EXPECT_EQ(server.hear_after(20).size(), static_cast<std::size_t>(accepted));
}

TEST_F(core_client, counts_what_a_subscriber_does_not_take_and_what_does_not_fit) {
  on.offer_now(pair_kind::subscribe_text, "/in", 10, {.depth = 2});
  peer server{on, side::client};
  for (int i = 0; i < 5; ++i) server.say(R"({"op":"publish","topic":"/in","msg":{"d":1}})");
  server.say(R"({"op":"publish","topic":"/in","msg":{"data":"too long for it"}})");
  on.cycles(2);
  EXPECT_EQ(on.count(counter::inbox_full), 3U);
  EXPECT_EQ(on.count(counter::too_big), 1U);
}

TEST_F(core_client, never_answers_a_server_and_shows_its_status) {
  peer server{on, side::client};
  server.say(R"({"op":"status","level":"error","msg":"no such topic"})");
  server.say(R"({"op":"subscribe","topic":"/x"})");
  server.say("nonsense");
  EXPECT_TRUE(server.hear_after(2).empty());
  bool shown = false;
  while (const auto what = on.shared.try_event())
    shown = shown || what->what_kind == rowe::event::kind::status_from_peer;
  EXPECT_TRUE(shown);
}

TEST_F(core_client, reports_why_its_server_has_closed_on_a_message_that_was_too_long) {
  for (const auto& [code, reports] : {std::pair{"\x03\xf1", true}, std::pair{"\x03\xe9", false}}) {
    peer server{on, side::client};
    on.cycle();
    server.send(rowe::wire::opcode::close, std::string{code} + "a message of 70000 bytes exceeds the limit");
    on.cycle();
    bool reported = false;
    while (const auto what = on.shared.try_event()) {
      reported = reported || (what->what_kind == rowe::event::kind::status_from_peer &&
                              std::string_view{what->what} == "a message of 70000 bytes exceeds the limit");
    }
    EXPECT_EQ(reported, reports);
    server.leave();
    on.cycle();
  }
}

TEST_F(core_client, starts_afresh_after_a_lost_connection) {
  auto& pair = on.offer_now(pair_kind::publish_text, "/out", 100);
  peer server{on, side::client};
  (void)server.hear_after(1);
  on.net.link_of(server.id()).capacity_bytes = 3;
  ASSERT_TRUE(publish_text(on, pair, "{\"n\":1}"));
  on.cycle();
  server.leave(rowe::service::close_cause::reset);
  on.cycles(2);
  const auto before = on.net.attempts();
  on.cycles(300);
  EXPECT_EQ(on.net.attempts(), before + 1);
  peer again{on, side::client};
  EXPECT_EQ(again.hear_after(2).size(), 1U); // the advertisement; nothing of what was queued for the old one
  EXPECT_EQ(again.violated, "");
  ASSERT_TRUE(publish_text(on, pair, "{\"n\":2}"));
  on.cycle();
  EXPECT_EQ(again.hear(), texts{R"({"op":"publish","topic":"/out","msg":{"n":2}})"});
}

} // namespace
} // namespace core_client_test
