// SPDX-License-Identifier: Apache-2.0
// The places that are reserved for peers on service::stop_path.
#include "net/connections/established.hpp"

#include <algorithm>

#include "net/base/socket_options.hpp"

namespace rowe::net {

using service::close_cause;
using service::stop_place_protected_for;
using service::transport_sink;

// A peer that comes to stop gets a place while any is free, a reserved one too. Then another peer on the path
// is displaced: the oldest one, unless the sink says that it has just stopped the robot.
//
// A crowd of peers must keep nobody out. So one source, except loopback, has only one of the reserved places.
// When it comes again, or beyond connections_per_address_max, its own connection is displaced. A connection
// of another source is displaced only when that source has had its place for stop_place_protected_for. The
// time is counted for the source, so closing and coming back does not begin it anew.
//
// Where the process has no descriptor left, as many may come as such places are reserved. Beyond that, the
// same holds among those.
bool established::make_room_for_stop(const socket_address& peer, bool lent, transport_sink& sink) noexcept {
  const auto of_its_own = [&](const connection& one) { return same_source(one.peer, peer); };
  const auto held_long = [&](const connection& one) {
    return now_ - stop_visits_.since(one.stop_visit) >= stop_place_protected_for;
  };
  report_ended(sink);
  const bool instead = !is_loopback(peer) &&
                       (free_.size() <= reserved_for_stop(limits_.connections_max) ||
                        count_from(peer) >= limits_.connections_per_address_max) &&
                       std::any_of(connections_.begin(), connections_.end(), [&](const connection& one) {
                         return is_in_use(one) && one.why == purpose::stop && of_its_own(one);
                       });
  const auto is_lent = [&](const connection& one) { return is_in_use(one) && one.lent; };
  const bool none_kept = lent && std::count_if(connections_.begin(), connections_.end(), is_lent) >=
                                     static_cast<std::ptrdiff_t>(reserved_for_stop(limits_.connections_max));
  if (!instead && !none_kept && !free_.empty()) return true;
  const auto among = [&](const auto& wanted) {
    return [&](const connection& one) { return (!none_kept || one.lent) && wanted(one); };
  };
  return displace_oldest(sink, among(of_its_own)) || (!instead && displace_oldest(sink, among(held_long)));
}

template <class Wanted>
bool established::displace_oldest(transport_sink& sink, Wanted&& wanted) noexcept {
  connection* oldest = nullptr;
  for (connection& one : connections_) {
    if (!is_in_use(one) || one.why != purpose::stop || !wanted(one)) continue;
    if (oldest != nullptr && one.opened_at >= oldest->opened_at) continue;
    if (sink.may_displace(id_of(one))) oldest = &one;
  }
  if (oldest == nullptr) return false;
  sink.displace(id_of(*oldest));
  if (is_in_use(*oldest)) { // unread bytes would make this a reset, which may overtake the close frame
    if (oldest->bytes) (void)discard_input(oldest->bytes.get());
    end(*oldest, close_cause::asked);
  }
  report_ended(sink);
  return true;
}

} // namespace rowe::net
