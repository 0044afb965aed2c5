// SPDX-License-Identifier: Apache-2.0
// The parts that calls stand on, put together as the core does, with peers that are connected and no
// transport: for tests of the parts that begin and end calls.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/call_completion.hpp"
#include "service/state_fixture.hpp"

namespace call_parts {

using namespace std::chrono_literals;
using rowe::service::call_endpoint;
using rowe::service::connection;
using rowe::service::connection_id;
using rowe::service::counter;
using rowe::service::peer_index;

inline rowe::limits few() {
  rowe::limits bounds;
  bounds.small_slots = 2 * rowe::service::replies_max;
  bounds.small_slot_bytes = 256;
  bounds.large_slots = 1;
  bounds.message_bytes_max = 1024;
  bounds.connections_max = 4;
  bounds.calls_max = 16;
  bounds.calls_per_connection_max = 8;
  bounds.services_max = 8;
  bounds.lanes_max = 2;
  bounds.door_slots = 4;
  return bounds;
}

struct call_parts : state_fixture::state_fixture {
  explicit call_parts(const rowe::endpoint_options& chosen = ::state_fixture::with(few()))
      : state_fixture{chosen} {}

  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};
  rowe::service::refusals refused{memory, {.state = state, .out = out}};
  rowe::service::local_delivery delivery{state};
  rowe::service::receiver inbox{memory, {.state = state, .out = out, .delivery = delivery}};
  rowe::service::direct_messages messages{
      memory, {.state = state, .store = store, .out = out, .delivery = delivery, .inbox = inbox}};
  rowe::service::call_completion completion{memory,
                                            {.state = state,
                                             .store = store,
                                             .out = out,
                                             .refused = refused,
                                             .messages = messages,
                                             .delivery = delivery}};

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
  // What is queued for a peer as answers, oldest first.
  std::vector<std::string> replies(const connection& to) {
    std::vector<std::string> all;
    for (auto at = out.of({to.id.index}).replies.entries.head; at; at = out.entries().after(at)) {
      const auto text = store.slots().text(out.entries().at(at).index);
      all.emplace_back(text.begin(), text.end());
    }
    return all;
  }
  // No further answer to it finds room.
  void fill(const connection& to) {
    while (out.has_place_for_reply({to.id.index}))
      ASSERT_TRUE(out.reply({to.id.index}, [](rowe::json::writer& into) { into.append("{}"); }));
  }
  void TearDown() override {
    EXPECT_TRUE(calls.check());
    EXPECT_TRUE(completion.check());
    EXPECT_TRUE(due.check());
    EXPECT_TRUE(store.check());
  }
};

} // namespace call_parts
