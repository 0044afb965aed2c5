// SPDX-License-Identifier: Apache-2.0
// Who a peer is, and whether it may do what it asks for. A peer shows a token before it is connected, and has
// the role of whoever the token belongs to until it is gone. A request that its role does not allow changes
// nothing: it is refused, counted and reported with the name of who asked. Stops are not asked about here:
// everyone who is connected may stop. Service thread only; nothing waits, and only admit() allocates.
#pragma once
#include <string_view>

#include <rowe/detail/mutation_points.hpp>

#include "access/policy.hpp"
#include "service/core_state.hpp"
#include "service/refusals.hpp"
#include "wire/request.hpp"

namespace rowe::service {

class access_control {
 public:
  struct needs {
    core_state& state;
    class refusals& refusals;
  };
  explicit access_control(const needs& parts) noexcept
      : state_{parts.state}, refusals_{parts.refusals}, policy_{parts.state.seams.access} {}

  // Whether somebody who shows this may connect, and who it is.
  admit_answer admit(const credentials& shown) const noexcept;

  // Whether the peer's role allows its request. If not, the request is refused.
  bool permits(connection& c, const wire::request& asked) noexcept {
    return !applies_to(c) || decide(c, asked);
  }
  // The same for the stop, whose own answer says that it was refused. Without roles, whoever is on this
  // machine may reset and guard.
  bool may(const connection& c, access::right what) const noexcept {
    if (!applies_to(c)) return c.local;
    return policy_->allows(c.who.role, what) || (what == access::right::reset && ROWE_MUTANT(role_reset));
  }

 private:
  bool applies_to(const connection& c) const noexcept {
    return policy_ != nullptr && policy_->in_use() && c.ours == side::server;
  }
  bool decide(connection& c, const wire::request& asked) noexcept;

  core_state& state_;
  refusals& refusals_;
  const access::policy* policy_;
};

} // namespace rowe::service
