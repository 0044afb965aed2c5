// SPDX-License-Identifier: Apache-2.0
// The parts that topics stand on, put together as the core does, with peers that are connected and no
// transport: for tests of subscriptions, of advertisements and of values that are passed on.
#pragma once
#include <gtest/gtest.h>

#include <string_view>

#include "service/incoming/peer_parts.hpp"
#include "service/topics/advertisements.hpp"
#include "service/topics/broker.hpp"

namespace topic_parts {

using namespace ::peer_parts;
using rowe::service::topic_id;
using rowe::wire::request;

inline rowe::limits few() {
  return {.connections_max = 4,
          .message_bytes_max = 1024,
          .refusals_per_second_max = 0, // no limit
          .topics_max = 36, // 32 for peers: a claim to 4 for each, and the other 16 for whoever comes
          .subscriptions_max = 32,
          .subscriptions_per_connection_max = 32,
          .advertisements_per_connection_max = 32,
          .small_slots = 256,
          .small_slot_bytes = 512,
          .large_slots = 1,
          .queue_depth_max = 8,
          .queued_max = 256,
          .latched_bytes = 8 * 1024,
          .handles_max = 2};
}

struct topic_parts : peer_parts::peer_parts {
  explicit topic_parts(bool relay = false) : peer_parts{::state_fixture::with(few(), relay)} {}

  rowe::service::publish_predictor phases{memory, bounds, counts};
  rowe::service::audiences audience{{.state_ = state, .publish_predictor_ = phases}};
  rowe::service::topic_rates rates{{.state_ = state, .statistics_topic_ = {}}};
  rowe::service::advertisement_table advertised{memory, bounds};
  rowe::service::topic_places places{
      {.state_ = state, .advertisement_table_ = advertised, .refusals_ = refused}};
  rowe::service::subscriptions readers{memory,
                                       {.state_ = state,
                                        .subscription_queues_ = queues,
                                        .refusals_ = refused,
                                        .audiences_ = audience,
                                        .topic_rates_ = rates,
                                        .topic_places_ = places}};
  rowe::service::advertisements writers{{.state_ = state,
                                         .advertisement_table_ = advertised,
                                         .refusals_ = refused,
                                         .topic_places_ = places,
                                         .subscriptions_ = readers}};
  rowe::service::long_deliveries long_ones{memory, {.state_ = state, .local_delivery_ = delivery}};
  rowe::service::broker values{{.state_ = state,
                                .message_store_ = store,
                                .outbox_ = out,
                                .long_outbox_ = long_out,
                                .subscription_queues_ = queues,
                                .refusals_ = refused,
                                .local_delivery_ = delivery,
                                .long_deliveries_ = long_ones,
                                .command_gate_ = gate,
                                .advertisement_table_ = advertised}};

  // Its connection has ended.
  void leave(connection& c) {
    const peer_index peer{c.id.index};
    readers.forget(peer);
    writers.forget(peer);
    out.forget(peer);
    c.state = connection::phase::free;
    peers.remove();
  }

  static request of(const connection& c, std::string_view topic, std::string_view id = {}) {
    request asked;
    asked.codec = c.protocol->topics.id();
    asked.topic = topic;
    asked.id_raw = id;
    return asked;
  }
  void subscribe(connection& c, std::string_view topic, std::string_view id = {}) {
    readers.subscribe(c, of(c, topic, id));
  }
  void unsubscribe(connection& c, std::string_view topic, std::string_view id = {}) {
    readers.unsubscribe(c, of(c, topic, id));
  }
  void advertise(connection& c, std::string_view topic, std::string_view type = {}) {
    request asked = of(c, topic);
    asked.type = type;
    writers.advertise(c, asked);
  }
  // As a handle of this process holds it.
  topic_id hold_as_own(std::string_view name) {
    const topic_id topic = topics.find_or_add(name);
    topics.hold_as_own(topic);
    return topic;
  }
  bool subscribed(const connection& c, std::string_view topic) {
    const topic_id found = topics.find(topic);
    return found && subscriptions.find(found, {c.id.index});
  }
  void TearDown() override {
    EXPECT_TRUE(readers.check());
    peer_parts::TearDown();
  }
};

} // namespace topic_parts
