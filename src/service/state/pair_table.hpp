// SPDX-License-Identifier: Apache-2.0
// What the service thread knows of the queue pair of each handle, besides what it shares with that handle.
// Service thread only.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/base/ids.hpp"
#include "service/state/latched_values.hpp"

namespace rowe::service {

struct pair_row {
  bool attached = false;
  bool busy = false;       // a long value is being copied into its inbox, so it gets no other one
  bool driven = false;     // it has a lease: what it gets are commands
  bool long_texts = false; // it may publish long texts, or structs whose text is long
  topic_id topic{};
  pair_index next_inbox{};
  std::uint64_t sequence = 0;    // of the newest value taken from a window
  std::uint64_t last_queued = 0; // closing: all is written when the queue to the server has popped so many
  std::uint32_t generation = 0;  // of the queue pair: raised when it is attached
  service_index service{};       // responders: in the directory
  loop_index loop{};             // stop latches: in the rules
  pair_slot spare{};             // a slot of its inbox that was taken and not used
  pair_slot parked_first{};      // parked slots, oldest and
  pair_slot parked_last{};       // newest; each slot names the next
  std::uint64_t order = 0;       // the generic receiver is the one that was attached first
  rt::time_point
      undecodable_at{}; // when an event last reported a message that it could not decode; zero: never
  latched_place latched_delivered{}; // the last latched value that it was given when it subscribed,
  std::uint64_t latched_until = 0;   // and the number of the last one that it is to be given
  std::uint32_t room_asked = 0;      // the handle's queue_pair::room_asked when this thread last looked
  bool released_slots = false;       // slots were released in this cycle
};

} // namespace rowe::service
