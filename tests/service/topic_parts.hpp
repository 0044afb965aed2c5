// SPDX-License-Identifier: Apache-2.0
// The parts that topics stand on, put together as the core does, with peers that are connected and no
// transport: for tests of subscriptions, of advertisements and of values that are passed on.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/advertisements.hpp"
#include "service/broker.hpp"
#include "service/state_fixture.hpp"

namespace topic_parts {

using namespace std::chrono_literals;
using rowe::service::connection;
using rowe::service::counter;
using rowe::service::latch_owner;
using rowe::service::peer_index;
using rowe::service::topic_id;
using rowe::wire::request;

inline rowe::limits few() {
  rowe::limits bounds;
  bounds.small_slots = 256;
  bounds.small_slot_bytes = 512;
  bounds.large_slots = 1;
  bounds.message_bytes_max = 1024;
  bounds.queued_max = 256;
  bounds.queue_depth_max = 8;
  bounds.connections_max = 4;
  bounds.lanes_max = 2;
  bounds.topics_max = 36; // 32 for peers: a claim to 4 for each, and the other 16 for whoever comes
  bounds.subscriptions_max = 32;
  bounds.subscriptions_per_connection_max = 32;
  bounds.advertisements_per_connection_max = 32;
  bounds.latched_bytes = 8 * 1024;
  bounds.refusals_per_second_max = 0; // no limit
  return bounds;
}

struct topic_parts : state_fixture::state_fixture {
  explicit topic_parts(bool relay = false) : state_fixture{::state_fixture::with(few(), relay)} {}

  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};
  rowe::service::subscription_queues queues{{.state = state, .store = store, .out = out}};
  rowe::service::refusals refused{memory, {.state = state, .out = out}};
  rowe::service::local_delivery delivery{state};
  rowe::service::publish_predictor phases{memory, bounds, counts};
  rowe::service::audiences audience{{.state = state, .predictor = phases}};
  rowe::service::topic_rates rates{{.state = state, .statistics_topic = {}}};
  rowe::service::advertisement_table advertised{memory, bounds};
  rowe::service::topic_places places{{.state = state, .advertised = advertised, .refused = refused}};
  rowe::service::subscriptions readers{{.state = state,
                                        .queues = queues,
                                        .refused = refused,
                                        .audience = audience,
                                        .rates = rates,
                                        .places = places}};
  rowe::service::advertisements writers{
      {.state = state, .advertised = advertised, .refused = refused, .places = places, .readers = readers}};
  rowe::service::broker values{{.state = state,
                                .store = store,
                                .out = out,
                                .queues = queues,
                                .refused = refused,
                                .delivery = delivery,
                                .advertised = advertised}};

  connection& join(std::uint32_t index) {
    connection& c = peers[{index}];
    c = {};
    c.id = {index, 1};
    c.state = connection::phase::open;
    c.protocol = &protocols.find({});
    peers.add();
    out.open({index});
    refused.open({index});
    return c;
  }
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
  // What a peer was told, oldest first.
  std::vector<std::string> told(const connection& to) {
    std::vector<std::string> all;
    for (auto at = out.of({to.id.index}).replies.entries.head; at; at = out.entries().after(at)) {
      const auto text = store.slots().text(out.entries().at(at).index);
      all.emplace_back(text.begin(), text.end());
    }
    return all;
  }
  bool was_told(const connection& to, std::string_view part) {
    for (const std::string& text : told(to)) {
      if (text.find(part) != std::string::npos) return true;
    }
    return false;
  }
  void TearDown() override {
    EXPECT_TRUE(readers.check());
    EXPECT_TRUE(store.check());
    EXPECT_TRUE(due.check());
  }
};

} // namespace topic_parts
