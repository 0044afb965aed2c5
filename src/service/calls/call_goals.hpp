// SPDX-License-Identifier: Apache-2.0
// Goals of actions: calls with answers in between, which whoever sent them may take back. Only peers provide
// actions. A goal has no end of its own, so it counts as a call of its sender until its result, and once it
// is taken back it ends within the time of a call. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <string_view>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct call_goals_needs {
  core_state& state_;
  outbox& outbox_;
  refusals& refusals_;
};

class call_goals : call_goals_needs {
 public:
  explicit call_goals(const call_goals_needs& parts) noexcept : call_goals_needs{parts} {}

  // The call, or the goal, that a peer answers. None, counted: it has ended, or it is not the peer's.
  call_index find_answered(const connection& c, std::string_view id_raw, bool goal) noexcept {
    const auto meant = state_.calls.read_id(id_raw);
    call* const found = meant ? state_.calls.find(*meant) : nullptr;
    const bool late = meant && found == nullptr;
    const bool may = found != nullptr && (found->callee.is(c.id) || ROWE_MUTANT(goal_foreign));
    if (may && state_.calls.is_goal({meant->index}) == goal) return {meant->index};
    state_.counts.add(late ? counter::replies_late : counter::replies_foreign);
    return {};
  }
  // The provider says how far a goal is.

  // Feedback that finds no place is lost, and counted. It leaves places for answers that end something.
  void take_feedback(const connection& c, const wire::request& said) noexcept {
    const call_index index = find_answered(c, said.id_raw, true);
    if (!index) return;
    const call& goal = state_.calls.at(index);
    if (!goal.wants_feedback) return;
    connection* const asker = state_.peers.find(goal.caller.connection());
    if (asker == nullptr || !asker->open()) return state_.counts.add(counter::replies_unsent);
    const peer_index to{ROWE_MUTANT(goal_feedback) ? c.id.index : asker->id.index};
    if (!outbox_.has_place_for_reply(to) || outbox_.of(to).replies.count >= feedback_queued_max)
      return state_.counts.add(counter::outbox_full);
    const wire::codec& codec = state_.seams.protocols.of(goal.caller.speaks);
    const wire::call_origin origin = state_.calls.origin(index);
    // Its slot is not needed: nobody tracks it, and one that is lost is counted.
    (void)outbox_.reply(to, [&](json::writer& into) {
      return codec.write_feedback(into, origin, wire::body{said.body_raw});
    });
  }
  // Whoever sent a goal takes it back. The provider may still say how it ended.
  void cancel(connection& c, const wire::request& asked) noexcept {
    const call_index index = state_.calls.find_asked(c.id, asked.id_raw);
    if (!index || !state_.calls.is_goal(index) || state_.calls.service(index) != asked.service)
      return refusals_.refuse(c, asked.id_raw, "cancel_action_goal: no goal of this action has this id");
    call& goal = state_.calls.at(index);
    if (goal.cancelled || goal.answered) return;
    abandon(index);
    const rt::time_point until = rt::deadline_after(state_.cycle.now, state_.options.call_timeout);
    if (until >= goal.deadline || ROWE_MUTANT(goal_taken_back)) return;
    goal.deadline = until;
    goal.timeout = state_.options.call_timeout;
    state_.due.disarm(index);
    state_.due.arm(index, until);
  }
  // Reports to the provider, once, that nobody waits for the goal any more. Does nothing for other calls.
  void abandon(call_index index) noexcept {
    call& goal = state_.calls.at(index);
    if (!state_.calls.is_goal(index) || goal.cancelled || ROWE_MUTANT(goal_abandoned)) return;
    goal.cancelled = true;
    connection* const provider = state_.peers.find(goal.callee.connection());
    if (provider == nullptr || !provider->open() || state_.cycle.closing) return;
    std::array<char, call_table::our_id_bytes_max> buffer;
    const std::string_view id = state_.calls.write_id(buffer, index, goal.goal_epoch);
    const wire::codec& codec = state_.seams.protocols.of(goal.callee.speaks);
    // A provider that does not get it may still end the goal, or its time does.
    (void)outbox_.reply({provider->id.index}, [&](json::writer& into) {
      return codec.write_cancel(into, state_.calls.service(index), id);
    });
  }

 private:
};

} // namespace rowe::service
