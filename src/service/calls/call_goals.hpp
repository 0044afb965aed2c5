// SPDX-License-Identifier: Apache-2.0
// Goals of actions: calls with answers in between, which whoever sent them may take back. Only peers provide
// actions. A goal has no end of its own, so it counts as a call of its sender until its result, and once it
// is taken back it ends within the time of a call. Service thread only; nothing waits or allocates.
#pragma once
#include <string_view>

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
  call_index find_answered(const connection& c, std::string_view id_raw, bool goal) noexcept;
  // The provider says how far a goal is.
  void take_feedback(const connection& c, const wire::request& said) noexcept;
  // Whoever sent a goal takes it back. The provider may still say how it ended.
  void cancel(connection& c, const wire::request& asked) noexcept;
  // Tells the provider, once, that nobody waits for the goal any more. Does nothing for other calls.
  void abandon(call_index goal) noexcept;

 private:
};

} // namespace rowe::service
