// SPDX-License-Identifier: Apache-2.0
// Publishes to the publishers of this process whether anybody listens. Service thread only; nothing waits or
// allocates.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>

#include "service/state/core_state.hpp"
#include "service/topics/publish_predictor.hpp"

namespace rowe::service {

struct audiences_needs {
  core_state& state_;
  publish_predictor& publish_predictor_;
};

class audiences : audiences_needs {
 public:
  explicit audiences(const audiences_needs& parts) noexcept : audiences_needs{parts} {}

  // The listeners of the topic may have changed.
  void update(topic_id index) noexcept {
    using detail::audience;
    topic& on = state_.topics.at(index);
    ++on.audience_changes;
    (void)state_.recordings.look(index);
    const bool heard = on.has_audience();
    if (!heard) on.newest_at = {};   // no values come from now on, and the pause must not count as a gap
    if (on.own_holders == 0) return; // no handle of this process publishes it
    for (const pair_index i : state_.pairs.ids()) {
      const pair_row& row = state_.pair_rows[i];
      if (!row.attached || row.topic != index) continue;
      detail::queue_pair& pair = state_.pairs[i];
      if (detail::subscribes(pair.kind)) continue;
      const bool wanted = heard || pair.latched;
      const audience now = wanted ? audience::somebody : audience::nobody;
      if (pair.audience.advice() == now) continue;
      wanted ? ++listened_ : --listened_;
      publish_predictor_.listen(i, wanted);
      pair.audience.set(now);
    }
  }
  // A publisher is detached.
  void leave(pair_index pair) noexcept {
    if (state_.pairs[pair].audience.advice() == detail::audience::somebody) --listened_;
  }
  // How many publishers somebody listens to.
  std::uint32_t listened() const noexcept { return listened_; }

 private:
  std::uint32_t listened_ = 0;
};

} // namespace rowe::service
