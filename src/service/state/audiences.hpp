// SPDX-License-Identifier: Apache-2.0
// Tells publishers of this process whether anybody listens. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>

#include "service/state/core_state.hpp"
#include "service/state/publish_predictor.hpp"

namespace rowe::service {

struct audiences_needs {
  core_state& state_;
  publish_predictor& publish_predictor_;
};

class audiences : audiences_needs {
 public:
  explicit audiences(const audiences_needs& parts) noexcept : audiences_needs{parts} {}

  // The listeners of the topic may have changed.
  void update(topic_id topic) noexcept;
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
