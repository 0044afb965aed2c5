// SPDX-License-Identifier: Apache-2.0
// The pings of each connection, one kind for two questions: how much of what was written is read (credit.hpp
// says what follows from that), and whether a peer that says nothing is alive.
#include <bit>
#include <cstring>

#include "service/core.hpp"

namespace rowe::service {

void core::begin_credit(connection& c) noexcept {
  if (options_.profile != peer_profile::standard) return; // Hop's programs answer no pings
  std::array<wire::mask_key, 2> dice;
  for (wire::mask_key& one : dice) one = next_mask();
  c.credit.begin(std::bit_cast<std::uint64_t>(dice));
}

// Puts a ping among the control frames if it is time for one; `behind` bytes are written before these. False
// when it has to wait until the control frames that are there are gone.
bool core::ping_if_wanted(connection& c, std::size_t behind) noexcept {
  if (!c.open() || !c.credit.wants_ping(now_)) return true;
  if (!c.control.rest().empty()) return false;
  const wire::role ours = masks(c) ? wire::role::client : wire::role::server;
  const std::size_t frame = wire::frame_header_bytes(credit::ping_bytes, ours) + credit::ping_bytes;
  place_control(c, wire::opcode::ping, c.credit.ping(behind + frame, now_));
  return true;
}

void core::take_pong(connection& c, std::span<const std::byte> payload) noexcept {
  if (!c.credit.take_pong(payload, now_)) return; // of nobody's ping: having been heard is all it is for
  c.slow = false;
  if (c.near != c.credit.near()) {
    c.near = !c.near;
    carrier_.set_near(c.id, c.near);
  }
  if (c.held || c.credit.settling()) list(c);
}

// With look_after().
void core::look_after_credit(connection& c) noexcept {
  if (c.credit.wants_ping(now_)) list(c);
  if (c.slow || c.unheard || !c.credit.slow(now_)) return;
  c.slow = true;
  add(counter::slow_peers);
}

} // namespace rowe::service
