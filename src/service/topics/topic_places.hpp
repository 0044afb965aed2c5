// SPDX-License-Identifier: Apache-2.0
// How many topics a peer may hold. Each peer takes at most its share of the places (shares.hpp). A topic that
// a handle of this process holds costs a peer nothing. When the last holder leaves, what is retained of its
// values is cleared. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <utility>

#include "service/base/shares.hpp"
#include "service/incoming/refusals.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct topic_places_needs {
  core_state& state_;
  const advertisement_table& advertisement_table_;
  refusals& refusals_;
};

class topic_places : topic_places_needs {
 public:
  topic_places(const topic_places_needs& parts) noexcept : topic_places_needs{parts} {}

  // Finds or adds the topic that a peer wants to hold. None: the peer may not have one more, and a status
  // said so.
  topic_id topic_for(connection& c, const wire::request& asked) noexcept;
  // How many topics a peer holds that no handle of this process has. A topic counts once for each
  // subscription and once for its advertisement.
  std::uint32_t held_by(peer_index peer) const noexcept;

  void hold(topic_id topic) noexcept { state_.topics.hold(topic); }
  void let_go(topic_id topic) noexcept {
    clear_of_last(topic);
    (void)state_.topics.let_go(topic); // whether it was the last one matters to nobody here
  }
  void let_go_own(topic_id topic) noexcept { // of a handle of this process
    clear_of_last(topic);
    (void)state_.topics.let_go_as_own(topic); // likewise
  }
  void forget_latched(topic_id topic, latch_owner owner) noexcept {
    state_.latches.forget(state_.topics.at(topic).latched, owner);
  }

  // Each topic is held by its subscriptions, advertisements and handles. `own_held`: the weights
  // (check_sum.hpp) of what handles and the endpoint hold.
  bool check(std::uint64_t own_held) const noexcept;

 private:
  claims claims_now(std::uint32_t share) noexcept;
  bool holds(peer_index peer, topic_id topic) const noexcept {
    return state_.subscriptions.find(topic, peer) || advertisement_table_.find(peer, topic) != nullptr;
  }
  void clear_of_last(topic_id topic) noexcept {
    struct topic& on = state_.topics.at(topic);
    if (on.holders != 1) return;
    state_.latches.clear(on.latched);
    state_.last_values.remove(on.set_asked({}));
  }

  std::uint32_t charged_ = 0; // counts of claims_now()
};

} // namespace rowe::service
