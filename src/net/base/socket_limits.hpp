// SPDX-License-Identifier: Apache-2.0
// What follows from the limits of a transport. Set-up.
#pragma once
#include <cstddef>

#include <rowe/result.hpp>

#include "net/transport/socket_transport.hpp"

namespace rowe::net {

// Whether each is in its range; else bad_argument with what was given, and the bound it broke.
status check(const socket_limits& limits) noexcept;

// How many descriptors a server keeps: for one who is accepted, and for a duplicate; for who comes to stop,
// under TLS each with a pair; and for who has come for that.
std::size_t kept_of_descriptors(const socket_limits& limits, bool tls) noexcept;

} // namespace rowe::net
