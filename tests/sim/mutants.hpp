// SPDX-License-Identifier: Apache-2.0
// The mutants of the service. Each takes one fix out again, where ROWE_MUTANT(name) stands in the sources,
// and the swarm worlds must find it. A fix that keeps peers from harming each other gets its line here.
#pragma once
#include <string_view>

namespace swarm {

struct mutant {
  std::string_view name;
  std::string_view takes_out;
};

inline constexpr mutant mutants[] = {
    {"depth", "a queue that is shortened drops only what has not expired, and at once"},
    {"hoarder", "a message is evicted from the peer that holds most, also when it reads well"},
    {"made_up_topics", "one peer holds no more topics than it leaves"},
    {"made_up_services", "likewise services"},
    {"pinned_type", "a handle's type wins over the one that peers gave its topic"},
    {"pinned_service", "a handle provides the service whose name a peer has taken"},
    {"latch_of_others", "only what its publisher asked to be kept is kept for late subscribers"},
    {"latch_of_the_gone", "a kept value goes with its publisher"},
    {"throttle", "a subscription that is changed is due by its new throttle_rate"},
    {"stop_tick", "a reset names a tick that was issued after the newest stop"},
    {"thread_reset", "a reset of a thread is older than a stop that comes while it waits"},
    {"stop_number", "the number of the stop never comes again"},
    {"stop_latch", "what loops see of that number rises once a millisecond at most"},
    {"stop_id", "the id of a stop that is answered is not overwritten by what the stop says"},
    {"rates", "/rowe/stats has the rates of the last seconds"},
    {"given_up_rows", "the rows of calls that were given up come free"},
    {"inbox_share", "one peer has a share of the receiver's slots"},
    {"pong_room", "a long pong that takes a short one's place fits there"},
};

} // namespace swarm
