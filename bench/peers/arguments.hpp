// SPDX-License-Identifier: Apache-2.0
// What a server of bench/peers is started with: see ../peers.hpp.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace rowe::bench {

enum class serving { echo, flood, sink, fan_out };

struct peer_arguments {
  std::uint16_t port = 0;
  serving mode = serving::echo;
  bool busy = false;                 // --busy: asks for events without waiting for them
  std::string_view layer = "frames"; // rowe only
  std::string_view idle = "spin";    // rowe only
  bool clamped = true;               // rowe only; --unclamped
};

inline peer_arguments arguments_of(int count, char** given) {
  peer_arguments all;
  for (int i = 1; i < count; ++i) {
    const std::string_view name = given[i];
    const std::string_view value = i + 1 < count ? given[i + 1] : "";
    if (name == "--busy") all.busy = true;
    if (name == "--unclamped") all.clamped = false;
    if (name == "--port") all.port = static_cast<std::uint16_t>(std::atoi(value.data()));
    if (name == "--layer") all.layer = value;
    if (name == "--idle") all.idle = value;
    if (name != "--mode") continue;
    all.mode = value == "flood"     ? serving::flood
               : value == "sink"    ? serving::sink
               : value == "fan_out" ? serving::fan_out
                                    : serving::echo;
  }
  if (all.port != 0) return all;
  std::fprintf(stderr, "usage: %s --port N --mode echo|flood|sink|fan_out\n", given[0]);
  std::exit(2);
}

} // namespace rowe::bench
