// SPDX-License-Identifier: Apache-2.0
// What the service thread knows of the queue pairs of handles, beside what it shares with them. Service
// thread only.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/ids.hpp"
#include "service/wire_slots.hpp"

namespace rowe::service {

struct lane_view {
  bool attached = false;
  std::uint32_t topic = no_index;
  std::uint32_t next_inbox = no_index;
  std::uint64_t sequence = 0;    // of the newest value taken from a window
  std::uint64_t last_queued = 0; // closing: when the queue to the server has popped so many, all is written
  std::uint32_t generation = 0;  // of the lane: raised when it is attached
  std::uint32_t service = no_index;    // responders: in the directory
  std::uint32_t loop = no_index;       // stop latches: in the rules
  std::uint32_t spare = no_index;      // a slot of its inbox that was taken and not used
  std::uint32_t held_first = no_index; // slots that were taken and wait for room further on, in their
  std::uint32_t held_last = no_index;  // order, each naming the next
  std::uint64_t order = 0;             // the generic receiver is the one that was attached first
  rt::time_point misfit_at{};   // when an event last told of a message that it could not take; zero: never
  std::uint32_t room_asked = 0; // as its handle said when it was last told of room
  bool gave = false;            // slots went home in this cycle
};

} // namespace rowe::service
