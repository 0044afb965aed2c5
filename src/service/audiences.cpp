// SPDX-License-Identifier: Apache-2.0
#include "service/audiences.hpp"

namespace rowe::service {

void audiences::update(topic_id index) noexcept {
  using detail::audience;
  topic& on = topics_.at(index);
  ++on.audience_changes;
  const bool heard = on.has_audience();
  if (!heard) on.newest_at = {}; // the service thread sees no values from now on: the pause is no gap
  for (const pair_index i : lanes_.ids()) {
    if (!views_[i].attached || views_[i].topic != index || detail::subscribes(lanes_[i].kind)) continue;
    const bool wanted = heard || lanes_[i].latched;
    const audience now = wanted ? audience::somebody : audience::nobody;
    if (lanes_[i].audience.advice() == now) continue;
    wanted ? ++listened_ : --listened_;
    phases_.listen(i, wanted);
    lanes_[i].audience.set(now);
  }
}

} // namespace rowe::service
