// SPDX-License-Identifier: Apache-2.0
// Who a peer is, and whether it may do what it asks for. A peer presents a token before it is connected, and
// has the role of whoever the token belongs to until it is gone. A request that its role does not allow
// changes nothing: it is refused, counted and reported with the name of who asked. Stops are not asked about
// here: everyone who is connected may stop. Service thread only; nothing waits, and only admit(),
// may_log_in(), may_call() and may_subscribe() allocate, for the hash of a token.
#pragma once
#include <array>
#include <string_view>

#include <rowe/detail/mutation_points.hpp>

#include "access/policy.hpp"
#include "service/incoming/refusals.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

struct access_control_needs {
  core_state& state_;
  refusals& refusals_;
};

class access_control : access_control_needs {
 public:
  explicit access_control(const access_control_needs& parts) noexcept : access_control_needs{parts} {}

  // Whether somebody who presents this may connect, and who it is.
  admit_answer admit(const credentials& shown) const noexcept;

  // Whether the token that somebody presents is known.
  admit_answer may_log_in(const credentials& shown) const noexcept;

  // Whether somebody who presents this may have over HTTP what the service of this name answers.
  admit_answer may_call(const credentials& shown, std::string_view service) noexcept;
  // The same for the values of a topic. The answer is the same whether or not there is such a topic.
  admit_answer may_subscribe(const credentials& shown, std::string_view topic) noexcept;

  // Whether the peer's role allows its request. If not, the request is refused.
  bool permits(connection& c, const wire::request& asked) noexcept {
    return !state_.rights.apply_to(c) || decide(c, asked);
  }
  // The same for the stop, whose own answer says that it was refused. Without roles, whoever is on this
  // machine may reset and guard.
  bool may(const connection& c, access::right what) const noexcept {
    if (!state_.rights.apply_to(c)) return c.local;
    return state_.rights.policy().allows(c.who.role, what) ||
           (what == access::right::reset && ROWE_MUTANT(role_reset));
  }
  // Whether the peer may set the parameter; if not, `why` says who has no right to what.
  bool may_set(const connection& c, std::string_view parameter, wire::text_out& why) const noexcept;
  // The stop has refused the peer for want of that right: counted and reported as a denial.
  void report_denial(connection& c, access::right what) noexcept;

 private:
  bool decide(connection& c, const wire::request& asked) noexcept;
  // "anna, role driver, has no right to RIGHT"
  wire::text_out& write_denial(wire::text_out& into, access::subject who, access::right what) const noexcept;
  admit_answer forbid(access::subject who, access::right what, std::string_view name,
                      std::string_view remedy) noexcept;

  std::array<char, event_text_bytes_max> denial_; // of the last page that was forbidden
};

} // namespace rowe::service
