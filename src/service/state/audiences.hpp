// SPDX-License-Identifier: Apache-2.0
// Tells publishers of this process whether anybody listens. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>

#include "service/state/core_state.hpp"
#include "service/state/publish_predictor.hpp"

namespace rowe::service {

class audiences {
 public:
  struct needs {
    core_state& state;
    class publish_predictor& publish_predictor;
  };
  explicit audiences(const needs& parts) noexcept
      : state_{parts.state}, publish_predictor_{parts.publish_predictor} {}

  // The listeners of the topic may have changed.
  void update(topic_id topic) noexcept;
  // A publisher is detached.
  void leave(pair_index pair) noexcept {
    if (state_.pairs[pair].audience.advice() == detail::audience::somebody) --listened_;
  }
  // How many publishers somebody listens to.
  std::uint32_t listened() const noexcept { return listened_; }

 private:
  core_state& state_;
  publish_predictor& publish_predictor_;
  std::uint32_t listened_ = 0;
};

} // namespace rowe::service
