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
    {"throttle_ahead", "a message that is written before it is due counts from then"},
    {"stop_tick", "a reset names a tick that was issued after the newest stop"},
    {"thread_reset", "a reset of a thread is older than a stop that comes while it waits"},
    {"stop_number", "the number of the stop never comes again"},
    {"stop_latch", "what loops see of that number rises once a millisecond at most"},
    {"stop_id", "the id of a stop that is answered is not overwritten by what the stop says"},
    {"rates", "/rowe/stats has the rates of the last seconds"},
    {"given_up_rows", "the rows of calls that were given up come free"},
    {"inbox_share", "one peer has a share of the receiver's slots"},
    {"group_credit", "a message whose peer's credit is used up is not gathered"},
    {"group_urgent", "nor is one of a peer whose ping or pong goes first"},
    {"group_partial", "nor one of a peer of whose last frame a part is written"},
    {"group_slots", "each message of a group counts as one that may be partly written"},
    {"group_full", "a full group is written before the next peer's turn"},
    {"group_before", "a group is written before a peer that is no member"},
    {"group_refused", "a member of which the socket took nothing waits until it takes more"},
    {"group_place", "what a socket took counts for its own peer"},
    {"turn_budget", "the turn of a peer that is read alone ends after a stated amount of work"},
    {"fragment_work", "a fragment counts as work, and a turn ends among fragments, too"},
    {"backlog_turn", "one message of each peer is carried out in turn, not all of a peer's"},
    {"read_amount", "after a read that was too much for a turn the next one is small"},
    {"assembly_room", "what is read fits behind the fragments that are assembled"},
    {"bound_shrinks", "the bound on what is in flight follows a reader that becomes slow"},
    {"longer_way", "a round trip that has become longer is measured anew"},
    {"lone_pings", "a low-RTT peer is asked up to three times before it counts as far"},
    {"little_late", "so is one whose answer is a little too late to be one"},
    {"small_rate", "an answer to next to nothing says nothing about the peer's rate"},
    {"buffer_grows", "the kernel's send buffer grows with the bound"},
    {"buffer_shrinks", "it shrinks with the bound"},
    {"buffer_far", "the kernel decides about it where the round trip is long"},
    {"role_denied", "a request that a role does not allow is not carried out"},
    {"role_plain", "a pattern of names gives no right to plain messages"},
    {"role_reset", "only a role with that right resets"},
    {"role_resign", "to end the guard of others takes the right to reset"},
    {"role_token", "a token that nobody has lets nobody in"},
    {"role_local", "an address is no role unless one is chosen for it"},
    {"pong_room", "a long pong that takes a short one's place fits there"},
};

} // namespace swarm
