// SPDX-License-Identifier: Apache-2.0
// The room of control frames on one connection.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <vector>

#include "service/outgoing/control_frames.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {
namespace control_frames_test {
namespace {

// Places a frame as the core does; its payload is as many times the byte `mark`.
bool place(control_frames& in, wire::opcode what, std::size_t payload, unsigned char mark) {
  const std::size_t bytes = wire::frame_header_bytes(payload, wire::role::server) + payload;
  std::byte* const at = in.place(what, bytes);
  if (at == nullptr) return false;
  const std::size_t header = wire::write_frame_header(at, what, payload);
  std::memset(at + header, mark, payload);
  return true;
}

// Pings of every size from a peer that reads as it likes, a close at the end: what is written is whole
// frames, each as it was placed, and nothing behind the room is touched.
TEST(control_frames, are_whole_whatever_comes_and_however_it_is_written) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    struct {
      control_frames frames;
      std::array<std::byte, 1024> behind{};
    } here;
    std::mt19937 random{seed};
    std::vector<std::byte> stream;
    const auto write = [&](std::size_t most) {
      const auto rest = here.frames.rest().first(std::min(most, here.frames.rest().size()));
      stream.insert(stream.end(), rest.begin(), rest.end());
      here.frames.written += rest.size();
    };
    for (int i = 0; i < 200; ++i) {
      const std::size_t payload = random() % 3 == 0 ? random() % 126 : 125;
      const bool ping = random() % 5 == 0;
      (void)place(here.frames, ping ? wire::opcode::ping : wire::opcode::pong, payload,
                  static_cast<unsigned char>(payload));
      ASSERT_LE(here.frames.size, here.frames.bytes.size() - control_frames::frame_bytes_max);
      if (random() % 3 == 0) write(random() % 300);
    }
    ASSERT_TRUE(place(here.frames, wire::opcode::close, 0, 0));
    write(SIZE_MAX);
    std::array<std::byte, 4096> assembly;
    wire::frame_parser parser;
    parser.reset(wire::role::client, {.message_bytes_max = 1024, .fragments_max = 16}, assembly);
    bool closed = false;
    for (std::span<std::byte> rest{stream}; !rest.empty();) {
      const auto step = parser.next(rest);
      rest = rest.subspan(step.consumed);
      ASSERT_FALSE(closed);
      closed = step.event == wire::frame_event::close;
      if (closed) continue;
      ASSERT_TRUE(step.event == wire::frame_event::ping || step.event == wire::frame_event::pong) << seed;
      ASSERT_TRUE(std::all_of(step.payload.begin(), step.payload.end(), [&](std::byte b) {
        return std::to_integer<std::size_t>(b) == step.payload.size();
      }));
    }
    ASSERT_TRUE(closed);
    ASSERT_TRUE(
        std::all_of(here.behind.begin(), here.behind.end(), [](std::byte b) { return b == std::byte{0}; }));
  }
}

} // namespace
} // namespace control_frames_test
} // namespace rowe::service
