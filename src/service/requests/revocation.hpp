// SPDX-License-Identifier: Apache-2.0
// Judges each peer when other rights take the place of those that let it in. A peer that has lost one is
// closed: what it holds by that right goes with it, and it may come again with what is left. Service thread
// only; nothing waits or allocates.
#pragma once
#include <string_view>

#include "service/graph/listings.hpp"
#include "service/state/core_state.hpp"
#include "service/stop/stop_service.hpp"

namespace rowe::service {

struct revocation_needs {
  core_state& state_;
  listings& listings_;
  stop_service& stop_service_;
};

class revocation : revocation_needs {
 public:
  explicit revocation(const revocation_needs& parts) noexcept : revocation_needs{parts} {}

  // Other rights hold (peer_rights::renew()). Looks once at each peer. Those that are marked to be closed
  // count as closed from here on, and what they guard stops at once, and they drive no more.
  void judge_all() noexcept {
    for (connection& c : state_.peers) {
      if (c.state == connection::phase::free || c.ours == side::client) continue;
      const access::successor next = state_.rights.succeed(c);
      c.who = next.who;
      if (!c.open()) continue;
      using enum access::successor::fate;
      switch (next.what) {
      case kept: break;
      case grown: listings_.announce_again({c.id.index}); break;
      case changed: close(c, "role changed"); break;
      case revoked: close(c, "token revoked"); break;
      }
    }
  }

 private:
  void close(connection& c, std::string_view why) noexcept {
    state_.counts.add(counter::revoked_peers);
    state_.peers.close_later(c, why);
    stop_service_.leave(c);
  }
};

} // namespace rowe::service
