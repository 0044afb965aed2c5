// SPDX-License-Identifier: Apache-2.0
// The services that peers provide: what each peer may advertise, and its share of the directory (shares.hpp).
// A handle of this process may take over a service of a peer. Service thread only; nothing waits or
// allocates.
#pragma once
#include <cstddef>
#include <cstdint>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/shares.hpp"
#include "service/incoming/refusals.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct service_providers_needs {
  core_state& state_;
  service_directory& service_directory_;
  refusals& refusals_;
};

class service_providers : service_providers_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
  }
  service_providers(rt::arena& memory, const service_providers_needs& parts) noexcept;

  // A request of a peer, about a service or an action. A refusal says why.
  void advertise(connection& c, const wire::request& asked) noexcept;
  void unadvertise(connection& c, const wire::request& asked) noexcept;
  // From now on a handle provides the service of a peer, which gets a report. The peer's open calls go on.
  void take_from_peer(service_index service) noexcept;
  // A peer has left.
  void forget(connection_id peer) noexcept;

  bool check() const noexcept;

 private:
  // Whether the peer provides that entry of the directory.
  bool provides(connection_id peer, service_index service) const noexcept {
    const service_entry& entry = service_directory_.at(service);
    return !entry.pair && entry.peer == peer;
  }
  void remove(service_index service) noexcept;

  rows<peer_index, std::uint32_t> provided_; // how many, by peer
  claims claims_;
};

} // namespace rowe::service
