// SPDX-License-Identifier: Apache-2.0
// Whether this endpoint publishes a topic, or subscribes to it: by a handle, or by itself. Service thread
// only.
#pragma once
#include <string_view>

#include <rowe/detail/queue_pair.hpp>

#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {

class topic_holders {
 public:
  topic_holders(const core_state& state, const stop_rules& stop) noexcept
      : state_{state}, stop_rules_{stop} {}

  bool published_here(topic_id topic) const noexcept {
    if (state_.topics.of_peers(topic)) return false;
    const std::string_view name = state_.topics.name(topic);
    if (state_.options.ours == side::server && (name == wire::stats_name || name == wire::parameters_name))
      return true;
    if (stop_rules_.in_use() && name == wire::stop_state_name) return true;
    for (const pair_index i : state_.pairs.ids()) {
      const pair_row& row = state_.pair_rows[i];
      if (row.attached && row.topic == topic && detail::publishes(state_.pairs[i].kind)) return true;
    }
    return false;
  }
  bool subscribed_here(topic_id topic) const noexcept {
    return static_cast<bool>(state_.topics.at(topic).inboxes.head);
  }

 private:
  const core_state& state_;
  const stop_rules& stop_rules_;
};

} // namespace rowe::service
