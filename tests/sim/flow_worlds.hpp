// SPDX-License-Identifier: Apache-2.0
// Which world of links a seed runs, if any, and what these worlds check.
#pragma once
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "flow_credit.hpp"
#include "flow_groups.hpp"
#include "flow_reading.hpp"
#include "flow_roles.hpp"
#include "swarm_world.hpp"

namespace flow {

inline constexpr std::uint64_t one_in = 4; // seeds

inline std::unique_ptr<world> make_world(std::uint64_t seed, swarm::coverage& seen,
                                         const std::set<std::string>& without, bool trace) {
  if (seed % one_in == 3) return std::make_unique<roles>(seed, seen, without, trace);
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
      {"lease", "a role that may not guard is told so, and only who may reset ends the guard of others"},
      {"floor_stop", "a stop waits behind one small read of what its own peer said before"},
  };
  return all;
}

} // namespace flow
