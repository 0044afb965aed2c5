// SPDX-License-Identifier: Apache-2.0
// The control frames that wait for one peer. Service thread only.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include <rowe/detail/mutation_points.hpp>

#include "wire/websocket/websocket.hpp"

namespace rowe::service {

// Encoded frames: pongs, pings and the close frame, written before any message. Space for one frame is
// reserved for the close frame.
struct control_frames {
  static constexpr std::size_t frame_bytes_max = wire::frame_header_bytes_max + wire::control_bytes_max;

  std::array<std::byte, 4 * frame_bytes_max> bytes;
  std::size_t written = 0;
  std::size_t size = 0;
  std::size_t last_at = 0; // where the last frame begins

  std::span<const std::byte> rest() const noexcept { return {bytes.data() + written, size - written}; }

  // Reserves space for a frame; null: do not send it. If there is no space, the frame replaces the last one,
  // because only the latest ping needs a pong (RFC 6455 5.5.3). Our own ping is not sent behind other control
  // frames.
  std::byte* place(wire::opcode what, std::size_t frame_bytes) noexcept {
    if (written != 0) {
      std::memmove(bytes.data(), bytes.data() + written, size - written);
      size -= written;
      last_at -= std::min(last_at, written); // only the rest of the last frame may be left
      written = 0;
    }
    if (what == wire::opcode::ping && size != 0) return nullptr;
    // Space for the longest frame, not for this one, so any frame that replaces the last one fits.
    const std::size_t capacity = bytes.size() - (what == wire::opcode::close ? 0 : frame_bytes_max);
    if (capacity - size < (ROWE_MUTANT(pong_room) ? frame_bytes : frame_bytes_max)) size = last_at;
    last_at = size;
    size += frame_bytes;
    return bytes.data() + last_at;
  }
};

} // namespace rowe::service
