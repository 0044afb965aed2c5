// SPDX-License-Identifier: Apache-2.0
// Handles that record: from when one is attached, its sink hears the topics that it wants, as a subscriber
// does. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/result.hpp>

#include "service/state/core_state.hpp"
#include "service/topics/audiences.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/topic_rates.hpp"

namespace rowe::service {

struct recorder_handles_needs {
  core_state& state_;
  audiences& audiences_;
  topic_rates& topic_rates_;
  broker& broker_;
};

class recorder_handles : recorder_handles_needs {
 public:
  explicit recorder_handles(const recorder_handles_needs& parts) noexcept : recorder_handles_needs{parts} {}

  // Errors: too_many_recordings.
  status attach(pair_index pair) noexcept {
    const std::uint8_t mine = state_.recordings.add(*state_.pairs[pair].sink);
    if (mine == 0) return error{errc::too_many_recordings, recordings::sinks_max, recordings::sinks_max};
    state_.pair_rows[pair].attached = true;
    for (const topic_id i : state_.topics.topic_ids()) {
      if (state_.topics.at(i).holders == 0) continue;
      audiences_.update(i);
      if ((state_.topics.at(i).aside & mine) == 0) continue;
      topic_rates_.begin_for(i);
      broker_.recorded().keep_latched(i, mine);
    }
    return {};
  }
  void detach(pair_index pair) noexcept {
    state_.recordings.remove(*state_.pairs[pair].sink);
    for (const topic_id i : state_.topics.topic_ids())
      if (state_.topics.at(i).holders != 0) audiences_.update(i);
  }
};

} // namespace rowe::service
