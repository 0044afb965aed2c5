// SPDX-License-Identifier: Apache-2.0
#include "net/source_tally.hpp"

#include <algorithm>

namespace rowe::net {

// The source's own place; else a free one, or that of the source that has paused for the longest time.
source_tally::source& source_tally::place_of(const socket_address& from) noexcept {
  source* oldest = &sources_.front();
  for (source& one : sources_) {
    if (one.times != 0 && same_source(one.address, from)) return one;
    if (one.times == 0 ? oldest->times != 0 : oldest->times != 0 && one.since < oldest->since) oldest = &one;
  }
  *oldest = {.address = from};
  return *oldest;
}

std::uint32_t source_tally::note(const socket_address& from, rt::time_point now) noexcept {
  source& by = place_of(from);
  const auto forgiven = static_cast<std::uint64_t>((now - by.since) / forgiven_after_);
  by.times -= static_cast<std::uint32_t>(std::min<std::uint64_t>(by.times, forgiven));
  by.since = now;
  const std::uint32_t before = by.times;
  by.times = std::min(before + 1, most_);
  return before;
}

} // namespace rowe::net
