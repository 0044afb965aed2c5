// SPDX-License-Identifier: Apache-2.0
// Who has come to stop, and since when. A visit: a source is here, on connections of its own, with pauses
// shorter than stop_place_protected_for. So closing and coming back does not begin it anew. On loopback,
// where everybody is one source, each connection is a visit of its own, unless it comes back after a pause.
//
// Service thread; allocates only in its constructor. Linear in the number of connections.
#pragma once
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "net/base/address.hpp"
#include "service/base/transport.hpp"

namespace rowe::net {

class stop_visits {
 public:
  explicit stop_visits(std::uint32_t connections_max) : visits_(connections_max) {}

  // A connection from there is opened. Returns the number of its visit.
  std::uint32_t begin(const socket_address& source, rt::time_point now) noexcept {
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
  // A connection of that visit has ended.
  void end(std::uint32_t number, rt::time_point now) noexcept {
    --visits_[number].connections;
    visits_[number].left_at = now;
  }
  // Since when the visit lasts.
  rt::time_point since(std::uint32_t number) const noexcept { return visits_[number].since; }

 private:
  struct visit {
    socket_address source;
    std::uint32_t connections = 0;
    rt::time_point since{};
    rt::time_point left_at{};
  };
  static bool goes_on(const visit& one, rt::time_point now) noexcept {
    if (one.connections != 0) return !is_loopback(one.source);
    return now - one.left_at < service::stop_place_protected_for;
  }

  std::vector<visit> visits_; // those that ended longest ago are forgotten
};

} // namespace rowe::net
