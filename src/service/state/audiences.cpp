// SPDX-License-Identifier: Apache-2.0
#include "service/state/audiences.hpp"

namespace rowe::service {

void audiences::update(topic_id index) noexcept {
  using detail::audience;
  topic& on = state_.topics.at(index);
  ++on.audience_changes;
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

} // namespace rowe::service
