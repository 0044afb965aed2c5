// SPDX-License-Identifier: Apache-2.0
#include "service/state/core_state.hpp"

namespace rowe::service {

std::size_t core_state::footprint_bytes(const limits& bounds) noexcept {
  return timers::footprint_bytes(bounds) + peer_table::footprint_bytes(bounds) +
         chunk_store::footprint_bytes(bounds) + latched_values::footprint_bytes(bounds) +
         last_value_store::footprint_bytes(bounds) + topic_table::footprint_bytes(bounds) +
         subscription_table::footprint_bytes(bounds) + rt::arena::bytes_for<pair_row>(bounds.handles_max) +
         call_table::footprint_bytes(bounds);
}

core_state::core_state(rt::arena& memory, const core_options& chosen, const shared_parts& with_threads,
                       const core_seams& outside, rt::time_point start) noexcept
    : options{chosen},
      cycle{.now = start},
      shared{with_threads.shared},
      counts{shared.counts},
      events{cycle, shared},
      chunks{memory, outside.chunk_pool, options.bounds, outside.chunk_opener},
      due{memory, options.bounds, start},
      peers{memory, options.bounds},
      latches{memory, chunks, options.bounds},
      last_values{memory, chunks, options.bounds},
      long_pages{chunks},
      rights{outside.access},
      topics{memory, options.bounds, outside.protocols.envelope},
      recordings{topics, chunks},
      subscriptions{memory, options.bounds, topics},
      pairs{with_threads.pairs},
      pair_rows{memory.carve<pair_row>(options.bounds.handles_max)},
      calls{memory, options.bounds, claimants()},
      submissions{with_threads.submissions},
      threads_inbox{with_threads.inbox},
      seams{outside} {}

} // namespace rowe::service
