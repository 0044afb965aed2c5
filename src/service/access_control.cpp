// SPDX-License-Identifier: Apache-2.0
#include "service/access_control.hpp"

#include <array>
#include <optional>

#include <rowe/detail/mutation_points.hpp>

#include "service/names.hpp"
#include "service/service_limits.hpp"
#include "wire/own_names.hpp"
#include "wire/text_out.hpp"

namespace rowe::service {
namespace {

// What a request needs: a right, for a topic or a service.
struct needed {
  access::right right;
  std::string_view name;
};

std::optional<needed> needed_for(const wire::request& asked) noexcept {
  using wire::verb;
  switch (asked.what) {
  case verb::subscribe: // the stop's state is shown to everyone
    if (without_slash(asked.topic) == without_slash(wire::stop_state_name)) return std::nullopt;
    return needed{access::right::subscribe, asked.topic};
  case verb::publish: return needed{access::right::publish, asked.topic};
  case verb::message: return needed{access::right::publish, {}};
  case verb::advertise: return needed{access::right::advertise, asked.topic};
  case verb::call: return needed{access::right::call, asked.service};
  case verb::advertise_service: return needed{access::right::provide, asked.service};
  // What was allowed may be taken back, and an answer belongs to a call that was given to the peer.
  case verb::unsubscribe:
  case verb::unadvertise:
  case verb::unadvertise_service:
  case verb::reply:
  case verb::status:
  case verb::set_level:
  case verb::unsupported:
  case verb::unknown: break;
  }
  return std::nullopt;
}

} // namespace

admit_answer access_control::admit(const credentials& shown) const noexcept {
  if (policy_ == nullptr || !policy_->in_use()) return {};
  if (!shown.token.empty()) {
    const auto who = policy_->find(shown.token, shown.in_url);
    if (who || ROWE_MUTANT(role_token)) return {.who = who.value_or(access::subject{})};
    // A button whose token was taken away still stops.
    if (shown.path == stop_path && policy_->anonymous_may_stop()) return {};
    return {.status = 401,
            .what = "nobody here has this token",
            .remedy = shown.in_url ? "send it in the header Authorization; in a URL only tokens with "
                                     "`token_in_url` are taken"
                                   : "ask whoever runs this endpoint for one"};
  }
  const bool by_address = policy_->local().role != access::nobody || ROWE_MUTANT(role_local);
  if (is_loopback(shown.address) && by_address) return {.who = policy_->local()};
  if (shown.path == stop_path && policy_->anonymous_may_stop()) return {};
  return {.status = 401,
          .what = "this endpoint wants to know who you are",
          .remedy = "send `Authorization: Bearer TOKEN`, or offer the subprotocol `rowe.token.TOKEN` beside "
                    "another one"};
}

bool access_control::decide(connection& c, const wire::request& asked) noexcept {
  const auto wanted = needed_for(asked);
  if (wanted) state_.cycle.work_bytes += policy_->patterns(c.who.role, wanted->right) * pattern_work_bytes;
  if (!wanted || policy_->allows(c.who.role, wanted->right, wanted->name)) return true;
  if (ROWE_MUTANT(role_denied)) return true;
  std::array<char, event_text_bytes_max> buffer;
  wire::text_out why{buffer};
  const std::string_view who = policy_->identity_name(c.who.identity);
  if (!who.empty()) why.add(who).add(", ");
  why.add("role ").add(policy_->role_name(c.who.role)).add(", has no right to ");
  why.add(access::name_of(wanted->right)).add(" ");
  why.add_shortened(wanted->name.empty() ? "plain messages" : wanted->name, denied_name_bytes_shown);
  refusals_.deny(c, asked, why.text());
  return false;
}

} // namespace rowe::service
