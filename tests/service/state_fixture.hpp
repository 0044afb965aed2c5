// SPDX-License-Identifier: Apache-2.0
// The state of a core without its parts: for tests of parts by themselves, which put together what they need.
#pragma once
#include <gtest/gtest.h>

#include <chrono>

#include <rowe/endpoint.hpp>

#include "memory_transport/memory_transport.hpp"
#include "service/core_harness.hpp"
#include "service/core_state.hpp"
#include "service/memory_plan.hpp"

namespace state_fixture {

using namespace std::chrono_literals;

// An endpoint's options that differ from the default only in these.
inline rowe::endpoint_options with(const rowe::limits& bounds, bool relay = false) {
  rowe::endpoint_options options;
  options.limits = bounds;
  options.relay = relay;
  return options;
}

struct state_fixture : testing::Test {
  explicit state_fixture(const rowe::endpoint_options& chosen) : options{chosen} {}

  const rowe::endpoint_options options;
  const rowe::limits& bounds = options.limits;
  rowe::rt::arena memory{rowe::service::plan_memory(bounds).arena(), rowe::rt::page_lock::none};
  rowe::json::reader validator = rowe::json::reader::create(bounds.message_bytes_max, 16).value();
  const rowe::wire::protocol_set& protocols = rowe::wire::protocols_of(rowe::peer_profile::standard);
  rowe::net::memory_transport to_peers{bounds.connections_max};
  harness::seeded_entropy random{1};
  rowe::service::shared_state shown{memory, bounds};
  rowe::service::submission_queue submissions{memory, bounds};
  rowe::service::shared_inbox shared{memory, bounds};
  rowe::service::core_state state{
      memory,
      rowe::service::core_options::from(options, rowe::service::side::server, "robot"),
      {memory.carve<rowe::detail::queue_pair>(bounds.lanes_max), shown, submissions, shared},
      {to_peers, random, validator, nullptr, protocols},
      rowe::rt::time_point{1s}};
  rowe::service::cycle_state& cycle = state.cycle;
  rowe::service::counters& counts = state.counts;
  rowe::service::timers& due = state.due;
  rowe::service::peer_table& peers = state.peers;
  rowe::service::topic_table& topics = state.topics;
  rowe::service::subscription_table& subscriptions = state.subscriptions;
  rowe::service::call_table& calls = state.calls;
};

} // namespace state_fixture
