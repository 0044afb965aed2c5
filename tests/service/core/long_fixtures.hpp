// SPDX-License-Identifier: Apache-2.0
// What the tests of long messages and of long calls say: texts that are longer than message_bytes_max here.
#pragma once
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core_fixtures.hpp"

namespace long_fixtures {

inline rowe::endpoint_options options_with(std::uint32_t long_bytes, std::uint32_t slots = 8) {
  return harness::with_limits(harness::hub_options(), &rowe::limits::long_message_bytes_max, long_bytes,
                              &rowe::limits::long_slots, slots);
}

// A JSON object of about so many bytes; that of each seed is different.
inline std::string map_of(std::size_t bytes, int seed = 1) {
  std::mt19937 random{static_cast<std::uint32_t>(seed)};
  std::string made = R"({"data":[0)";
  while (made.size() + 8 < bytes) made += "," + std::to_string(random() % 100);
  return made + R"(],"é":"ü"})";
}

// The frame of a text, of which only so many bytes come.
inline std::vector<std::byte> begun(std::string_view text, std::size_t bytes) {
  std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + bytes);
  const std::size_t header = rowe::wire::write_frame_header(frame.data(), rowe::wire::opcode::text,
                                                            text.size(), rowe::wire::mask_key{});
  text.copy(reinterpret_cast<char*>(frame.data() + header), bytes);
  frame.resize(header + bytes);
  return frame;
}

} // namespace long_fixtures
