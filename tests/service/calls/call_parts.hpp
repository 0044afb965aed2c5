// SPDX-License-Identifier: Apache-2.0
// The parts that calls stand on, put together as the core does, with peers that are connected and no
// transport: for tests of the parts that begin and end calls.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/calls/call_completion.hpp"
#include "service/calls/long_calls.hpp"
#include "service/incoming/peer_parts.hpp"

namespace call_parts {

using namespace ::peer_parts;
using rowe::service::call_endpoint;

inline rowe::limits few() {
  return {.connections_max = 4,
          .message_bytes_max = 1024,
          .small_slots = 2 * rowe::service::replies_max,
          .small_slot_bytes = 256,
          .large_slots = 1,
          .services_max = 8,
          .calls_max = 16,
          .calls_per_connection_max = 8,
          .door_slots = 4,
          .handles_max = 2};
}

struct call_parts : peer_parts::peer_parts {
  explicit call_parts(const rowe::endpoint_options& chosen = ::state_fixture::with(few()))
      : peer_parts{chosen} {}

  rowe::service::direct_messages messages{memory,
                                          {.state_ = state,
                                           .message_store_ = store,
                                           .outbox_ = out,
                                           .local_delivery_ = delivery,
                                           .receiver_ = inbox}};
  rowe::service::long_ingress long_in{memory, state};
  rowe::service::call_completion completion{memory,
                                            {.state_ = state,
                                             .message_store_ = store,
                                             .outbox_ = out,
                                             .refusals_ = refused,
                                             .direct_messages_ = messages,
                                             .local_delivery_ = delivery}};
  rowe::service::long_calls of_long{{.state_ = state,
                                     .long_outbox_ = long_out,
                                     .long_ingress_ = long_in,
                                     .direct_messages_ = messages,
                                     .call_completion_ = completion}};

  // No further answer to it finds room.
  void fill(const connection& to) {
    while (out.has_place_for_reply({to.id.index}))
      ASSERT_TRUE(out.reply({to.id.index}, [](rowe::json::writer& into) { into.append("{}"); }));
  }
  void TearDown() override {
    EXPECT_TRUE(calls.check());
    EXPECT_TRUE(completion.check());
    EXPECT_TRUE(messages.check());
    peer_parts::TearDown();
  }
};

} // namespace call_parts
