// SPDX-License-Identifier: Apache-2.0
// The state of a core without its parts: for tests of parts by themselves, which put together what they need.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <rowe/endpoint.hpp>

#include "api/pair_memory.hpp"
#include "memory_transport/memory_transport.hpp"
#include "service/core/core_harness.hpp"
#include "service/core/memory_plan.hpp"
#include "service/state/core_state.hpp"

namespace state_fixture {

using namespace std::chrono_literals;

// An endpoint's options that differ from the default only in these.
inline rowe::endpoint_options with(const rowe::limits& bounds, bool relay = false) {
  rowe::endpoint_options options;
  options.limits = bounds;
  options.relay = relay;
  return options;
}

// What lies outside of a core's state.
struct outside_fixture : testing::Test {
  explicit outside_fixture(
      const rowe::endpoint_options& chosen, rowe::service::side side = rowe::service::side::server,
      const rowe::wire::protocol_set& spoken = rowe::wire::protocols_of(rowe::websocket_profile::standard))
      : options{chosen}, ours{side}, protocols{spoken} {}

  const rowe::endpoint_options options;
  const rowe::service::side ours;
  const rowe::wire::protocol_set& protocols;
  const rowe::limits& bounds = options.limits;
  rowe::rt::arena memory{rowe::service::plan_memory(bounds).arena() +
                             rowe::service::plan_memory(bounds).pair_memory,
                         rowe::rt::page_lock::none};
  rowe::json::reader validator = rowe::json::reader::create(bounds.message_bytes_max, 16).value();
  rowe::net::memory_transport transport{bounds.connections_max};
  harness::seeded_entropy random{1};
  rowe::service::shared_state shared{memory, bounds};
  rowe::service::submission_queue submissions{memory, bounds};
  rowe::service::shared_inbox threads_inbox{memory, bounds};
  std::vector<std::unique_ptr<rowe::detail::pair_codecs>> codecs;

  rowe::service::core_options chosen_options() const {
    return rowe::service::core_options::from(options, ours, "robot");
  }
  rowe::service::shared_parts with_threads() {
    return {memory.carve<rowe::detail::queue_pair>(bounds.handles_max), shared, submissions, threads_inbox};
  }
  rowe::access::policy access;
  rowe::service::policy_handover<> rights{access};
  rowe::service::core_seams seams() { return {transport, random, validator, nullptr, protocols, rights}; }
  static constexpr rowe::rt::time_point start_time{1s};

  // The events since the last look.
  std::vector<rowe::event> events() {
    std::vector<rowe::event> all;
    while (const auto one = shared.try_event()) all.push_back(*one);
    return all;
  }
  // Builds and offers a queue pair as set-up does, at the first place that is free.
  rowe::service::pair_index offer(const rowe::service::core_state& to,
                                  const rowe::detail::pair_request& asked) {
    rowe::service::pair_index at{0};
    while (!to.pairs[at].lifecycle.is_free()) ++at.value;
    rowe::detail::queue_pair& one = to.pairs[at];
    const std::size_t bytes = rowe::detail::pair_bytes(asked);
    if (one.memory.size() < bytes) one.memory = memory.carve_bytes(bytes);
    rowe::detail::build_pair(one, asked, shared.generations());
    one.peers_taking = shared.takers();
    one.granted = &shared.permit;
    auto& compiled = *codecs.emplace_back(std::make_unique<rowe::detail::pair_codecs>(
        std::move(rowe::detail::pair_codecs::compile(asked, {})).value()));
    one.encoder = compiled.encoder ? &*compiled.encoder : nullptr;
    one.other_encoders = compiled.others();
    one.decoder = compiled.decoder ? &*compiled.decoder : nullptr;
    shared.use_pair(at.value);
    one.lifecycle.offer();
    return at;
  }
};

struct state_fixture : outside_fixture {
  using outside_fixture::outside_fixture;

  rowe::service::core_state state{memory, chosen_options(), with_threads(), seams(), start_time};
  rowe::service::cycle_state& cycle = state.cycle;
  rowe::service::counters& counts = state.counts;
  rowe::service::timers& due = state.due;
  rowe::service::peer_table& peers = state.peers;
  rowe::service::topic_table& topics = state.topics;
  rowe::service::subscription_table& subscriptions = state.subscriptions;
  rowe::service::call_table& calls = state.calls;

  rowe::service::pair_index offer(const rowe::detail::pair_request& asked) {
    return outside_fixture::offer(state, asked);
  }
};

// What a handle's thread takes from one of its queues; empty: there is nothing.
inline std::string taken(rowe::detail::consumer_end& from) {
  const auto slot = from.ring->try_pop();
  if (!slot) return {};
  std::string text{reinterpret_cast<const char*>(from.memory.value(*slot)), from.memory.header(*slot)->bytes};
  from.free_ring->release(*slot);
  return text;
}

} // namespace state_fixture
