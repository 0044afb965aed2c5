// SPDX-License-Identifier: Apache-2.0
#include "net/connections/stop_visits.hpp"

#include <algorithm>
#include <utility>

#include "service/base/transport.hpp"

namespace rowe::net {

bool stop_visits::goes_on(const visit& one, rt::time_point now) noexcept {
  if (one.connections != 0) return !is_loopback(one.source);
  return now - one.left_at < service::stop_place_kept_for;
}

std::uint32_t stop_visits::begin(const socket_address& source, rt::time_point now) noexcept {
  auto found = std::find_if(visits_.begin(), visits_.end(), [&](const visit& one) {
    return same_source(one.source, source) && goes_on(one, now);
  });
  if (found == visits_.end()) {
    // Takes the visit that ended longest ago. There are as many visits as connections, so one has ended.
    found = std::min_element(visits_.begin(), visits_.end(), [](const visit& a, const visit& b) {
      return std::pair{a.connections != 0, a.left_at} < std::pair{b.connections != 0, b.left_at};
    });
    *found = {.source = source, .since = now};
  }
  ++found->connections;
  return static_cast<std::uint32_t>(found - visits_.begin());
}

void stop_visits::end(std::uint32_t number, rt::time_point now) noexcept {
  --visits_[number].connections;
  visits_[number].left_at = now;
}

} // namespace rowe::net
