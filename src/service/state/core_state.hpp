// SPDX-License-Identifier: Apache-2.0
// Folder state: the tables and their rows. They store and find; they write to no peer and call no part.
// What all parts of the core share: the time, the counters, the tables, and the seams to what is outside.
// Service thread only, except the queue pairs and the members that are references.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/chunk_store.hpp"
#include "service/base/counters.hpp"
#include "service/base/ids.hpp"
#include "service/state/call_table.hpp"
#include "service/state/cycle_state.hpp"
#include "service/state/event_log.hpp"
#include "service/state/last_value_store.hpp"
#include "service/state/latched_values.hpp"
#include "service/state/page_texts.hpp"
#include "service/state/pair_table.hpp"
#include "service/state/peer_rights.hpp"
#include "service/state/peer_table.hpp"
#include "service/state/recordings.hpp"
#include "service/state/subscription_table.hpp"
#include "service/state/timers.hpp"
#include "service/state/topic_table.hpp"
#include "service/threads/core_options.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/shared_state.hpp"
#include "service/threads/submission_queue.hpp"

namespace rowe::service {

// What other threads use, too.
struct shared_parts {
  rows<pair_index, detail::queue_pair> pairs;
  shared_state& shared;
  submission_queue& submissions;
  shared_inbox& inbox;
};

struct core_state {
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // Time begins at `start`.
  core_state(rt::arena& memory, const core_options& chosen, const shared_parts& with_threads,
             const core_seams& outside, rt::time_point start) noexcept;
  core_state(const core_state&) = delete;

  const limits& bounds() const noexcept { return options.bounds; }
  // How many connections there may be. Each has a claim to its share (shares.hpp).
  std::uint32_t claimants() const noexcept {
    return options.ours == side::client ? 1 : options.bounds.connections_max;
  }

  // The time now, where the cycle's is too old. Reads the clock.
  rt::time_point clock() const noexcept {
    return seams.clock == nullptr ? cycle.now : std::max(cycle.now, seams.clock());
  }

  const core_options options;
  // Another one each time an endpoint is opened, so that peers can distinguish a restart from a reconnect.
  std::uint64_t epoch = 0;
  cycle_state cycle;
  shared_state& shared;
  counters& counts;
  event_log events;
  chunk_store chunks;
  timers due;
  peer_table peers;
  latched_values latches;
  last_value_store last_values;
  page_texts long_pages;
  peer_rights rights;
  topic_table topics;
  class recordings recordings;
  subscription_table subscriptions;
  const rows<pair_index, detail::queue_pair> pairs;
  const rows<pair_index, pair_row> pair_rows;
  call_table calls;
  submission_queue& submissions;
  shared_inbox& threads_inbox;
  const core_seams seams;
};

} // namespace rowe::service
