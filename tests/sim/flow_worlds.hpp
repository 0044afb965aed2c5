// SPDX-License-Identifier: Apache-2.0
// Which world of links a seed runs, if any, and what these worlds check.
#pragma once
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "flow_credit.hpp"
#include "flow_driving.hpp"
#include "flow_groups.hpp"
#include "flow_hops.hpp"
#include "flow_long.hpp"
#include "flow_reading.hpp"
#include "flow_roles.hpp"
#include "swarm_world.hpp"

namespace flow {

inline constexpr std::uint64_t one_in = 4; // seeds

inline std::unique_ptr<world> make_world(std::uint64_t seed, swarm::coverage& seen,
                                         const std::set<std::string>& without, bool trace) {
  if (seed % (4 * one_in) == 3) return std::make_unique<hops>(seed, seen, without, trace);
  if (seed % one_in == 3) return std::make_unique<roles>(seed, seen, without, trace);
  if (seed % (4 * one_in) == 2) return std::make_unique<long_messages>(seed, seen, without, trace);
  if (seed % (2 * one_in) == 4) return std::make_unique<driving>(seed, seen, without, trace);
  if (seed % one_in != 1) return nullptr;
  switch (seed / one_in % 3) {
  case 0: return std::make_unique<groups>(seed, seen, without, trace);
  case 1: return std::make_unique<credits>(seed, seen, without, trace);
  default: return std::make_unique<reading>(seed, seen, without, trace);
  }
}

inline const std::vector<swarm::invariant>& invariants() {
  static const std::vector<swarm::invariant> all = {
      {"order", "a client gets the messages of a topic in order, and none twice"},
      {"whole", "a message arrives as it was said"},
      {"reached", "who reads gets each message"},
      {"in_flight", "what is in flight follows the rate of who reads it"},
      {"busy", "who reads is kept busy"},
      {"send_buffer", "the kernel's send buffer follows what is in flight"},
      {"round_trip", "who is near counts as near, whatever single answer is late, and others as far"},
      {"turn", "a cycle carries out a stated amount of what was read"},
      {"admitted", "who shows a token that is known is let in, and who may come without one"},
      {"denied", "what a role does not allow is refused and leaves no trace; the rest is carried out"},
      {"stop", "whoever is let in may stop"},
      {"reset", "a role that may not reset never lets a loop go"},
      {"revoked", "who has lost a right, or the token, is closed in the same cycle, and nobody else"},
      {"seen", "a peer is shown what it may subscribe to, and nothing else"},
      {"guard", "a role that may not guard is told so, and only who may reset ends the guard of others"},
      {"hop_over", "nothing is taken after its time to live, but for the time between endpoints"},
      {"hop_told", "a rowe endpoint is told what is left of a time to live, and nobody else"},
      {"hop_stale", "nothing comes behind what its publisher said later, whatever breaks in between"},
      {"stream", "a stream of short messages beside long ones loses nothing, and waits for a few cycles"},
      {"judged", "a long message that is wrong is told why, or closed with the code for it"},
      {"told", "whoever loses a long message that it sends is told so, and nobody else"},
      {"answered", "a call between peers, long or not, ends once, by its answer or for a reason"},
      {"floor_long", "endless messages keep nobody out who has sent no long message before"},
      {"floor_reading", "who does not read a long message keeps others from theirs for a second at most"},
      {"honest_refused", "nobody is refused what is right"},
      {"drive_lease", "no command is in force when its lease is over, counted from when it was really sent"},
      {"drive_two", "what is in force is of the one who drives, and no two drive under one number"},
      {"drive_stop", "nothing is in force while the robot is stopped, nor what was sent before the stop"},
      {"drive_gone", "whose connection is over drives no more"},
      {"drive_hold", "who has been silent for as long as control is kept drives no more"},
      {"drive_right", "who takes over from somebody that drives has the right to"},
      {"drive_still", "the robot stands still when nobody has said anything for a lease"},
      {"drive_alone", "an honest driver that is alone is obeyed within a second"},
      {"floor_stop", "a stop waits behind one small read of what its own peer said before"},
  };
  return all;
}

} // namespace flow
