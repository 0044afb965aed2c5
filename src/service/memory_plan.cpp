// SPDX-License-Identifier: Apache-2.0
#include "service/memory_plan.hpp"

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/waker.hpp>

#include "service/core.hpp"
#include "service/shared_inbox.hpp"
#include "service/shared_state.hpp"
#include "service/submission_queue.hpp"

namespace rowe::service {

memory_plan plan_memory(const limits& bounds) noexcept {
  using rt::arena;
  return {
      .core = arena::bytes_for<core>() + core::footprint_bytes(bounds),
      .shared = arena::bytes_for<shared_state>() + shared_state::footprint_bytes(bounds),
      .threads = arena::bytes_for<submission_queue>() + submission_queue::footprint_bytes(bounds) +
                 arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(bounds),
      .waker = arena::bytes_for<rt::waker<>>(),
      .pairs = arena::bytes_for<detail::queue_pair>(bounds.lanes_max),
      .pair_memory = arena::bytes_for(bounds.lane_bytes),
      .handshakes = arena::bytes_for(bounds.handshake_bytes),
  };
}

} // namespace rowe::service

namespace rowe {

std::size_t limits::footprint_bytes() const noexcept { return service::plan_memory(*this).total(); }

} // namespace rowe
