// SPDX-License-Identifier: Apache-2.0
// What the verbs that send have in common.
#pragma once
#include <chrono>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

// How often a full queue is tried again: nothing tells of room.
inline constexpr rt::duration room_period = std::chrono::microseconds{200};
// For what is queued at the end, where --timeout does not say.
inline constexpr rt::duration drain_time = std::chrono::seconds{10};
// Hz; above this, sleeping between messages means nothing.
inline constexpr double rate_max = 100e3;

} // namespace rowe::tools
