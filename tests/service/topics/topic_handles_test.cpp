// SPDX-License-Identifier: Apache-2.0
#include "service/topics/topic_handles.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/topics/topic_parts.hpp"
#include "json/padded.hpp"

namespace topic_handles_test {
namespace {

using namespace topic_parts;
using rowe::errc;
using rowe::detail::audience;
using rowe::detail::pair_kind;
using rowe::service::pair_index;
using rowe::service::side;
using ::state_fixture::taken;

struct topic_handles_test : topic_parts::topic_parts {
  explicit topic_handles_test(side of = side::server) : topic_parts{true, of} {}

  rowe::service::topic_handles handles{{.state_ = state,
                                        .message_store_ = store,
                                        .outbox_ = out,
                                        .publish_predictor_ = phases,
                                        .audiences_ = audience,
                                        .topic_rates_ = rates,
                                        .topic_places_ = places,
                                        .subscriptions_ = readers,
                                        .advertisements_ = writers,
                                        .broker_ = values}};

  // A handle that set-up offers, for texts.
  pair_index offer_to(pair_kind kind, std::string_view topic, std::string_view type = {},
                      bool latched = false) {
    rowe::detail::pair_request asked{.kind = kind, .name = topic, .type = type, .latched = latched};
    (rowe::detail::publishes(kind) ? asked.out_depth : asked.in_depth) = 4;
    (rowe::detail::publishes(kind) ? asked.out_bytes : asked.in_bytes) = 128;
    const pair_index at = offer(asked);
    state.pair_rows[at] = {.generation = state.pair_rows[at].generation + 1};
    return at;
  }
  pair_index attach(pair_kind kind, std::string_view topic, std::string_view type = {},
                    bool latched = false) {
    const pair_index at = offer_to(kind, topic, type, latched);
    EXPECT_TRUE(handles.attach(at));
    state.pairs[at].lifecycle.accept(state.pairs[at].arrival);
    return at;
  }
  void detach(pair_index at) {
    handles.detach(at);
    state.pairs[at].lifecycle.close();
    state.pairs[at].lifecycle.release(state.pairs[at].arrival);
  }
  // As a handle that latches, or not.
  void publish(std::string_view topic, std::string_view body, latch_owner latches = {}) {
    values.publish(topics.find(topic), cycle.now, rowe::rt::never, latches,
                   [&](rowe::json::writer& into) { into.append(body); });
  }
  std::string next(pair_index at) { return taken(state.pairs[at].user.in); }
  rowe::detail::audience advice(pair_index at) { return state.pairs[at].audience.advice(); }
};
struct topic_handles_of_client : topic_handles_test {
  topic_handles_of_client() : topic_handles_test{side::client} {}
};

TEST_F(topic_handles_test, hold_their_topic_while_they_are_attached) {
  const pair_index writer = attach(pair_kind::publish_text, "/odom");
  const pair_index reader = attach(pair_kind::subscribe_text, "odom"); // the same
  EXPECT_EQ(topics.count(), 1U);
  detach(writer);
  EXPECT_EQ(topics.count(), 1U);
  detach(reader);
  EXPECT_EQ(topics.count(), 0U);
}

TEST_F(topic_handles_test, take_a_place_back_from_a_peer_and_none_from_another_handle) {
  connection& peer = join(0);
  connection& other = join(1);
  for (int i = 0; topics.count() < bounds.topics_max && i < 64; ++i) {
    advertise(peer, "/p" + std::to_string(i));
    advertise(other, "/q" + std::to_string(i));
  }
  for (int i = 0; topics.count() < bounds.topics_max; ++i) hold_as_own("/own" + std::to_string(i));
  const pair_index late = offer_to(pair_kind::publish_text, "/late");
  EXPECT_TRUE(handles.attach(late));
  EXPECT_TRUE(topics.find("/late"));
  EXPECT_EQ(topics.count(), bounds.topics_max);
  for (int i = 0; i < 64; ++i) { // until only this process has topics
    const topic_id more = topics.find_or_add("/more" + std::to_string(i));
    if (more)
      topics.hold_as_own(more);
    else if (!writers.take_back_topic())
      break;
  }
  const pair_index last = offer_to(pair_kind::publish_text, "/last");
  const rowe::status done = handles.attach(last);
  ASSERT_EQ(done.code(), errc::too_many_topics);
  EXPECT_EQ(done.error().limit, bounds.topics_max);
  EXPECT_FALSE(state.pair_rows[last].attached);
}

TEST_F(topic_handles_test, of_two_types_cannot_share_a_topic) {
  const pair_index first = attach(pair_kind::publish_text, "/odom", "a/Type");
  const pair_index second = offer_to(pair_kind::subscribe_text, "/odom", "b/Type");
  EXPECT_EQ(handles.attach(second).code(), errc::type_conflict);
  EXPECT_FALSE(state.pair_rows[second].attached);
  const auto happened = events();
  ASSERT_EQ(happened.size(), 1U);
  const std::string_view what{happened[0].what};
  EXPECT_NE(what.find("a/Type"), what.npos);
  EXPECT_NE(what.find("b/Type"), what.npos);
  EXPECT_EQ(topics.type(topics.find("/odom")), "a/Type");
  detach(first);
  EXPECT_EQ(topics.count(), 0U) << "the one that was refused holds nothing";
}

TEST_F(topic_handles_test, get_what_is_published_until_they_are_detached) {
  const pair_index first = attach(pair_kind::subscribe_text, "/chat");
  const pair_index second = attach(pair_kind::subscribe_text, "/chat");
  publish("/chat", "{\"n\":1}");
  EXPECT_EQ(next(first), "{\"n\":1}");
  EXPECT_EQ(next(second), "{\"n\":1}");
  detach(first); // which is not the first in the list
  publish("/chat", "{\"n\":2}");
  EXPECT_EQ(next(second), "{\"n\":2}");
  const pair_index again = attach(pair_kind::subscribe_text, "/chat");
  detach(again); // which is
  publish("/chat", "{\"n\":3}");
  EXPECT_EQ(next(second), "{\"n\":3}");
}

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

// ---- as a client

TEST_F(topic_handles_of_client, are_announced_by_the_first_of_their_kind_and_ended_by_the_last) {
  connection& server = join(0);
  const pair_index first = attach(pair_kind::publish_text, "odom", "a/Type");
  ASSERT_EQ(told(server).size(), 1U);
  EXPECT_TRUE(was_told(server, R"("op":"advertise")"));
  EXPECT_TRUE(was_told(server, R"("topic":"odom")")) << "as it calls the topic";
  const pair_index second = attach(pair_kind::publish_text, "/odom", "a/Type");
  EXPECT_EQ(told(server).size(), 1U);
  detach(first);
  EXPECT_EQ(told(server).size(), 1U);
  detach(second);
  ASSERT_EQ(told(server).size(), 2U);
  EXPECT_NE(told(server)[1].find(R"("op":"unadvertise")"), std::string::npos);
  EXPECT_NE(told(server)[1].find(R"("topic":"odom")"), std::string::npos) << "and still does";
}

} // namespace
} // namespace topic_handles_test
