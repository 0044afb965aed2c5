// SPDX-License-Identifier: Apache-2.0
// The core under idle::wake: handles tell when they hand something over, so that the next cycle need not come
// before; but for what stays in a queue pair until there is room further on.
#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include "core_fixtures.hpp"

namespace harness {
namespace core_waking_test {
namespace {

rowe::endpoint_options idle_by(rowe::idle policy) {
  rowe::endpoint_options options = small_options();
  options.idle_policy = policy;
  return options;
}

struct core_waking : core_test {
  core_waking() : core_test{idle_by(rowe::idle::wake)} {}
  // Whether handing over is seen, and by one cycle taken.
  template <class HandOver>
  void expect_told(HandOver hand_over) {
    on.cycles(2);
    EXPECT_TRUE(on.core.nothing_submitted());
    hand_over();
    EXPECT_FALSE(on.core.nothing_submitted());
    on.cycle();
    EXPECT_TRUE(on.core.nothing_submitted());
  }
};

TEST_F(core_waking, need_not_look_at_lanes_while_somebody_listens) {
  advertise_pose(on);
  peer p = peer_saying(on, R"({"op":"subscribe","topic":"/pose"})", 2);
  EXPECT_GT(on.core.idle_time_max(1ms), 9ms);
}

TEST_F(core_waking, is_told_what_publishers_hand_over) {
  for (const rowe::keep kept : {rowe::keep::all, rowe::keep::newest}) {
    auto& pair = advertise_pose(on, {.keep = kept, .latched = true});
    expect_told([&] { EXPECT_TRUE(publish(on, pair, {1, 0})); });
    expect_told([&] { EXPECT_TRUE(publish(on, pair, {2, 0})); });
  }
}

TEST_F(core_waking, is_told_nothing_where_nobody_listens) {
  auto& pair = advertise_pose(on);
  on.cycles(2);
  EXPECT_EQ(publish(on, pair, {1, 0}).code(), rowe::errc::no_peer);
  EXPECT_TRUE(on.core.nothing_submitted());
}

TEST_F(core_waking, is_told_what_lanes_callers_and_responders_hand_over) {
  using json = rowe::json_text;
  auto& talking = on.offer(rowe::detail::talk_request({.depth = 4, .inbox_depth = 4, .calls = 4}));
  auto& answering = on.offer(rowe::detail::serve_request<json, json>("/add", {.depth = 4}));
  auto& asking = on.offer(rowe::detail::client_request<json, json>("/add", {.depth = 4}));
  on.cycle();
  rowe::lane talk{core_harness::handle_of(talking)};
  rowe::responder<json, json> answers{core_harness::handle_of(answering)};
  rowe::caller<json, json> asks{core_harness::handle_of(asking)};
  expect_told([&] { EXPECT_TRUE(talk.try_send(R"({"a":1})", 1ms, on.now)); });
  expect_told([&] { EXPECT_TRUE(talk.start(R"({"service":"none"})", 1ms, on.now)); });
  for (int i = 0; i < 3; ++i) {
    expect_told([&] { EXPECT_TRUE(asks.start("{}", 1s, on.now)); });
    expect_told([&] {
      auto asked = answers.try_next(on.now);
      ASSERT_TRUE(asked);
      if (i == 0) {
        EXPECT_TRUE(answers.reply(*asked, "{}", on.now));
      } else if (i == 1) {
        EXPECT_TRUE(answers.refuse(*asked, "no", on.now));
      } // else it is dropped
    });
    EXPECT_TRUE(asks.try_finish());
  }
}

TEST_F(core_waking, looks_again_soon_while_a_message_waits_in_its_lane_for_room) {
  auto& talking = on.offer(rowe::detail::talk_request({.depth = 4, .inbox_depth = 4, .calls = 4}));
  peer slow = peer_saying(on, "{}", 2);
  rowe::lane talk{core_harness::handle_of(talking)};
  on.net.link_of(slow.id()).capacity_bytes = 0;
  for (std::uint32_t i = 0; i < on.options.limits.queue_depth_max; ++i) {
    EXPECT_TRUE(talk.try_send("{}", -1ns, on.now));
    on.cycle();
    EXPECT_GT(on.core.idle_time_max(1ms), 1ms) << "it is queued towards the peer";
  }
  EXPECT_TRUE(talk.try_send("{}", -1ns, on.now));
  on.cycle();
  EXPECT_EQ(on.core.idle_time_max(1ms), 1ms);
  on.net.link_of(slow.id()).capacity_bytes = 1 << 20;
  on.cycles(3);
  EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
  EXPECT_EQ(slow.hear().size(), on.options.limits.queue_depth_max + 1);
}

struct core_in_phase : core_test {
  core_in_phase() : core_test{idle_by(rowe::idle::phase)} {}
  // So many values, a period apart, and each found at once.
  void publish_in_time(rowe::detail::queue_pair& pair, int count) {
    while (count-- > 0) {
      on.now += 1ms;
      EXPECT_TRUE(publish(on, pair, {1, 0}));
      on.cycle(10us);
      on.now -= 10us;
    }
  }
  rowe::rt::time_point next() { return on.core.predictor().wait_until(on.now + 20us, 250us); }
};

TEST_F(core_in_phase, polls_for_topics_of_no_known_period) {
  (void)advertise_pose(on, {.latched = true});
  on.cycles(2);
  EXPECT_EQ(on.core.idle_time_max(1ms), 1ms);
  EXPECT_EQ(on.core.predictor().listened(), 0u);
}

TEST_F(core_in_phase, leaves_topics_with_a_period_to_the_plan) {
  auto& pair = advertise_pose_now(on, {.latched = true, .period = 1ms});
  EXPECT_GT(on.core.idle_time_max(1ms), 9ms);
  EXPECT_EQ(next(), on.now + 20us + 250us) << "nothing is known yet";
  publish_in_time(pair, 8);
  EXPECT_GT(next(), on.now + 500us);
  EXPECT_LT(next(), on.now + 1ms);
  EXPECT_EQ(on.count(counter::phase_misses), 8u);
}

TEST_F(core_in_phase, looks_for_nothing_where_nobody_listens_or_the_publisher_is_gone) {
  auto& pair = advertise_pose(on, {.period = 1ms});
  peer p{on};
  on.cycles(2);
  EXPECT_EQ(next(), rowe::rt::never);
  p.tell(R"({"op":"subscribe","topic":"/pose"})", 2);
  EXPECT_LT(next(), rowe::rt::never);
  p.tell(R"({"op":"unsubscribe","topic":"/pose"})", 2);
  EXPECT_EQ(next(), rowe::rt::never);
  p.tell(R"({"op":"subscribe","topic":"/pose"})", 2);
  pair.lifecycle.close();
  on.cycles(2);
  EXPECT_EQ(next(), rowe::rt::never);
  EXPECT_GT(on.core.idle_time_max(1ms), 9ms);
}

TEST_F(core_in_phase, is_awake_for_the_answer_to_a_call) {
  using json = rowe::json_text;
  auto& pair = on.offer_now(rowe::detail::serve_request<json, json>("/add", {.depth = 4}));
  rowe::responder<json, json> answers{core_harness::handle_of(pair)};
  peer p{on};
  on.cycle();
  EXPECT_EQ(next(), rowe::rt::never);
  p.tell(R"({"op":"call_service","id":"1","service":"/add"})");
  EXPECT_LE(next(), on.now + 20us) << "it turns without waiting";
  on.now += 20us;
  auto asked = answers.try_next(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(answers.reply(*asked, std::string_view{"{}"}, on.now));
  on.cycle(1us);
  EXPECT_EQ(next(), rowe::rt::never);
}

TEST(core_waking_client, looks_again_soon_while_values_wait_in_a_lane_for_the_server) {
  core_harness on{idle_by(rowe::idle::wake), rowe::service::side::client};
  auto& pair = on.offer_now(rowe::detail::pair_kind::publish_text, "/out", 100, {.depth = 32});
  peer server{on, rowe::service::side::client};
  (void)server.hear_after(1);
  on.net.link_of(server.id()).capacity_bytes = 0;
  for (std::uint32_t i = 0; i < on.options.limits.queue_depth_max; ++i) {
    EXPECT_TRUE(publish_text_now(on, pair, "{}"));
    EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
  }
  EXPECT_TRUE(publish_text_now(on, pair, "{}"));
  EXPECT_EQ(on.core.idle_time_max(1ms), 1ms) << "one more than the queue holds";
  on.net.link_of(server.id()).capacity_bytes = 1 << 20;
  on.cycles(4);
  EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
  EXPECT_TRUE(on.core.check());
}

TEST(core_waking_client, looks_again_soon_while_a_lane_that_closes_has_something_unsent) {
  core_harness on{idle_by(rowe::idle::wake), rowe::service::side::client};
  auto& pair = on.offer_now(rowe::detail::pair_kind::publish_text, "/out", 100, {.depth = 32});
  peer server{on, rowe::service::side::client};
  on.cycle();
  on.net.link_of(server.id()).capacity_bytes = 0;
  EXPECT_TRUE(publish_text(on, pair, "{}"));
  pair.lifecycle.close();
  on.cycle();
  EXPECT_EQ(on.core.idle_time_max(1ms), 1ms);
  on.net.link_of(server.id()).capacity_bytes = 1 << 20;
  on.cycles(3);
  EXPECT_GT(on.core.idle_time_max(1ms), 1ms);
  EXPECT_EQ(pair.lifecycle.look(), rowe::detail::pair_phase::free);
}

} // namespace
} // namespace core_waking_test
} // namespace harness
