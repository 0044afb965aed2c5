// SPDX-License-Identifier: Apache-2.0
// Posts events to the ring that threads of this process read. Service thread only; nothing waits or
// allocates.
#pragma once
#include <string_view>

#include <rowe/event.hpp>

#include "service/base/rate_limit.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/transport.hpp"
#include "service/state/cycle_state.hpp"
#include "service/threads/shared_state.hpp"

namespace rowe::service {

class event_log {
 public:
  event_log(const cycle_state& cycle, shared_state& shared) noexcept : cycle_{cycle}, shared_{shared} {}

  // An event that finds no place in the ring is counted as lost, and so are too many events about peers that
  // come and go.
  void report(event::kind kind, std::string_view peer, std::string_view what, std::string_view remedy = {},
              std::string_view identity = {}) noexcept {
    const bool of_coming = kind == event::kind::peer_joined || kind == event::kind::peer_left ||
                           kind == event::kind::refused_handshake;
    if (of_coming && !comings_.take(cycle_.now)) return shared_.counts.add(counter::events_lost);
    event happened;
    happened.what_kind = kind;
    happened.peer = peer;
    happened.identity = identity;
    happened.what = what;
    happened.remedy = remedy;
    shared_.post(happened);
  }

  void report_failed_attempt(const rejection& why) noexcept {
    event happened;
    happened.what_kind = event::kind::cannot_connect;
    happened.peer = why.peer;
    happened.what = why.what;
    happened.remedy = why.remedy;
    happened.lasting = why.lasting;
    shared_.post(happened);
  }

 private:
  const cycle_state& cycle_;
  shared_state& shared_;
  rate_limit comings_{coming_events_period, coming_events_burst};
};

} // namespace rowe::service
