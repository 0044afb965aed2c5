// SPDX-License-Identifier: Apache-2.0
#include "service/topics/topic_handles.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "service/topics/topic_parts.hpp"

namespace topic_handles_test {
namespace {

using namespace topic_parts;
using rowe::detail::audience;
using rowe::detail::pair_kind;
using rowe::service::pair_index;

struct topic_handles_test : topic_parts::topic_parts {
  topic_handles_test() : topic_parts{true} {}

  rowe::service::topic_handles handles{{.state_ = state,
                                        .message_store_ = store,
                                        .outbox_ = out,
                                        .publish_predictor_ = phases,
                                        .audiences_ = audience,
                                        .topic_rates_ = rates,
                                        .topic_places_ = places,
                                        .subscriptions_ = readers,
                                        .advertisements_ = writers,
                                        .command_gate_ = gate,
                                        .broker_ = values}};

  // A handle for texts.
  pair_index attach(pair_kind kind, std::string_view topic) {
    rowe::detail::pair_request asked{.kind = kind, .name = topic};
    (rowe::detail::publishes(kind) ? asked.out_depth : asked.in_depth) = 4;
    (rowe::detail::publishes(kind) ? asked.out_bytes : asked.in_bytes) = 128;
    const pair_index at = offer(asked);
    state.pair_rows[at] = {.generation = state.pair_rows[at].generation + 1};
    EXPECT_TRUE(handles.attach(at));
    state.pairs[at].lifecycle.accept(state.pairs[at].arrival);
    return at;
  }
  void detach(pair_index at) {
    handles.detach(at);
    state.pairs[at].lifecycle.close();
    state.pairs[at].lifecycle.release(state.pairs[at].arrival);
  }
  void publish(std::string_view topic, std::string_view body) {
    values.publish(topics.find(topic), cycle.now, rowe::rt::never, {},
                   [&](rowe::json::writer& into) { into.append(body); });
  }
  rowe::detail::audience advice(pair_index at) { return state.pairs[at].audience.advice(); }
};

TEST_F(topic_handles_test, know_whether_anybody_listens) {
  const pair_index writer = attach(pair_kind::publish_text, "/odom");
  EXPECT_EQ(advice(writer), audience::nobody);
  const pair_index reader = attach(pair_kind::subscribe_text, "/odom");
  EXPECT_EQ(advice(writer), audience::somebody);
  detach(reader);
  EXPECT_EQ(advice(writer), audience::nobody);
  connection& peer = join(0);
  subscribe(peer, "/odom");
  EXPECT_EQ(advice(writer), audience::somebody);
  leave(peer);
  EXPECT_EQ(advice(writer), audience::nobody);
}

TEST_F(topic_handles_test, give_more_at_once_only_where_everybody_has_room) {
  const pair_index writer = attach(pair_kind::publish_text, "/odom");
  connection& peer = join(0);
  subscribe(peer, "/odom");
  EXPECT_EQ(handles.ample_budget(writer, 0), bounds.queue_depth_max);
  publish("/odom", "{}");
  EXPECT_EQ(handles.ample_budget(writer, 0), bounds.queue_depth_max - 1);
  out.of({0}).blocked = true;
  EXPECT_EQ(handles.ample_budget(writer, 0), 0U);
  out.of({0}).blocked = false;
  EXPECT_EQ(handles.ample_budget(writer, 10'000), 0U) << "it has had that much";
  (void)attach(pair_kind::subscribe_text, "/odom");
  EXPECT_EQ(handles.ample_budget(writer, 0), 0U) << "a handle has a place for few";
}

} // namespace
} // namespace topic_handles_test
