// SPDX-License-Identifier: Apache-2.0
// The requests and results of a thread without a loop that stops the loops of its endpoint, or lets them go
// again: endpoint::emergency_stop() and reset_emergency_stop(). A software stop, which complements a wired
// one and never replaces it. See docs/stop.md.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe {

// Texts are UTF-8. A text that is too long is cut between two characters, and never prevents a stop.
struct emergency_stop_request {
  std::string_view source = {}; // who stops, reported to everyone; at most 63 bytes; empty: "this process"
  std::string_view reason = {}; // why, for the event (event::kind::stop); at most 192 bytes
};

// The stop that every loop has acknowledged.
struct emergency_stop_result {
  std::uint64_t number = 0;         // as peers know it, above 0; a later stop has another one
  rt::time_point acknowledged = {}; // when the last loop did, by its own clock
};

// Which stop is to end.
struct emergency_stop_reset_request {
  std::uint64_t number = 0; // 0: whichever there is when the service thread looks
};

struct emergency_stop_reset_result {
  std::uint64_t number = 0; // reported to peers while the loops may move
};

} // namespace rowe
