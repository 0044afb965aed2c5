// SPDX-License-Identifier: Apache-2.0
#include "service/requests/revocation.hpp"

namespace rowe::service {

void revocation::judge_all() noexcept {
  for (connection& c : state_.peers) {
    if (c.state == connection::phase::free || c.ours == side::client) continue;
    const access::successor next = state_.rights.succeed(c);
    c.who = next.who;
    if (!c.open()) continue;
    using enum access::successor::fate;
    switch (next.what) {
    case kept: break;
    case grown: listings_.tell_again({c.id.index}); break;
    case changed: close(c, "role changed"); break;
    case revoked: close(c, "token revoked"); break;
    }
  }
}

void revocation::close(connection& c, std::string_view why) noexcept {
  state_.counts.add(counter::revoked_peers);
  state_.peers.close_later(c, why);
  stop_service_.leave(c);
}

} // namespace rowe::service
