// SPDX-License-Identifier: Apache-2.0
// How many topics a peer may hold. Each peer takes at most its share of the places (shares.hpp). A topic that
// a handle of this process holds costs a peer nothing. When the last holder leaves, the latched value is
// cleared. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>

#include "service/advertisement_table.hpp"
#include "service/cycle_state.hpp"
#include "service/latch_store.hpp"
#include "service/peer_table.hpp"
#include "service/refusals.hpp"
#include "service/shares.hpp"
#include "service/topic_table.hpp"
#include "wire/request.hpp"

namespace rowe::service {

class topic_places {
 public:
  struct needs {
    cycle_state& cycle;
    peer_table& peers;
    topic_table& topics;
    const advertisement_table& advertised;
    latch_store& latches;
    refusals& refused;
    std::uint32_t claimants; // how many connections there may be, each with its claim
  };
  static constexpr std::uint32_t own_topics = 2; // statistics, and the stop's state

  topic_places(const limits& bounds, const needs& parts) noexcept
      : bounds_{bounds},
        cycle_{parts.cycle},
        peers_{parts.peers},
        topics_{parts.topics},
        advertised_{parts.advertised},
        latches_{parts.latches},
        refusals_{parts.refused},
        claimants_{parts.claimants} {}

  // The topic that a peer wants to hold; none, and the peer is told: it may not have one more.
  topic_id topic_for(connection& c, const wire::request& asked) noexcept;
  // How many topics a peer holds that no handle of this process has. A topic counts once for each
  // subscription and once for its advertisement.
  std::uint32_t held_by(peer_index peer) const noexcept;

  void hold(topic_id topic) noexcept { topics_.hold(topic); }
  void let_go(topic_id topic) noexcept {
    clear_of_last(topic);
    (void)topics_.let_go(topic); // whether it was the last one matters to nobody here
  }
  void let_go_own(topic_id topic) noexcept { // of a handle of this process
    clear_of_last(topic);
    (void)topics_.let_go_as_own(topic); // likewise
  }
  void forget_latched(topic_id topic, latch_owner owner) noexcept {
    latched_value& last = topics_.at(topic).last;
    if (last.owner == owner) latches_.clear(last);
  }

  // Each topic is held by its subscriptions, advertisements and handles. `own_held`: the weights
  // (check_sum.hpp) of what handles and the endpoint hold.
  bool check(std::uint64_t own_held) const noexcept;

 private:
  claims claims_now(std::uint32_t share) noexcept;
  bool holds(peer_index peer, topic_id topic) const noexcept {
    return topics_.find_subscription(topic, peer) || advertised_.find(peer, topic) != nullptr;
  }
  void clear_of_last(topic_id topic) noexcept {
    if (topics_.at(topic).holders == 1) latches_.clear(topics_.at(topic).last);
  }

  const limits bounds_;
  cycle_state& cycle_;
  peer_table& peers_;
  topic_table& topics_;
  const advertisement_table& advertised_;
  latch_store& latches_;
  refusals& refusals_;
  const std::uint32_t claimants_;
  std::uint32_t charged_ = 0; // counts of claims_now()
};

} // namespace rowe::service
