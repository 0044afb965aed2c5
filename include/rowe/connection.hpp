// SPDX-License-Identifier: Apache-2.0
// Connections: the established peers of an endpoint, as small values.
#pragma once
#include <cstdint>
#include <string>

#include <rowe/fixed_string.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe {

// One established connection. A plain value: copy it, keep it, compare it. It goes stale safely: when its
// peer has left, a message to it says errc::peer_lost, and never reaches another peer. A connection that was
// lost and made again is another one.
struct connection {
  std::uint32_t index = 0;      // its place among the endpoint's connections
  std::uint32_t generation = 0; // how often the place was used; 0: no connection

  // Whether it names a peer; it may be a peer that has left.
  ROWE_RT constexpr explicit operator bool() const noexcept { return generation != 0; }
  ROWE_RT friend constexpr bool operator==(const connection&, const connection&) noexcept = default;
};

// No peer in particular. As the address of a message it means every peer that takes plain messages; of an
// invocation, whoever can answer it.
inline constexpr connection everyone{};

// The name of an identity.
using identity_name = fixed_string<64>;

// What is known about a peer.
struct peer {
  connection id;
  std::string address;  // numeric, with its port
  std::string identity; // the name of who proved by a token who it is (access.hpp); else empty
};

} // namespace rowe
