// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/access_control.hpp"

#include <optional>

#include "service/base/service_limits.hpp"
#include "wire/codec/own_names.hpp"

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
  case verb::subscribe: return needed{access::right::subscribe, asked.topic};
  case verb::publish: return needed{access::right::publish, asked.topic};
  case verb::message: return needed{access::right::publish, {}};
  case verb::advertise: return needed{access::right::advertise, asked.topic};
  case verb::call:
    if (peer_rights::is_of_rights(asked.service)) return std::nullopt;
    [[fallthrough]];
  case verb::send_goal: return needed{access::right::call, asked.service};
  case verb::advertise_action:
  case verb::advertise_service: return needed{access::right::provide, asked.service};
  case verb::get_parameters:
  case verb::subscribe_parameters: return needed{access::right::call, wire::get_param_name};
  case verb::subscribe_graph: return needed{access::right::call, wire::node_details_name};
  // What was allowed may be taken back, and an answer belongs to a call or a goal that was given to the peer.
  case verb::unsubscribe:
  case verb::unadvertise:
  case verb::unadvertise_service:
  case verb::unadvertise_action:
  case verb::cancel_goal:
  case verb::goal_feedback:
  case verb::goal_result:
  case verb::reply:
  case verb::status:
  case verb::set_level:
  case verb::unsubscribe_parameters:
  case verb::unsubscribe_graph:
  case verb::set_parameters: // which takes a right for each of them (parameter_requests)
  case verb::fragment:       // the whole message takes its own
  case verb::unsupported:
  case verb::unknown: break;
  }
  return std::nullopt;
}

admit_answer unknown_token(std::string_view remedy) noexcept {
  return {.status = 401, .what = "this token is not known here", .remedy = remedy};
}

} // namespace

admit_answer access_control::admit(const credentials& shown) const noexcept {
  const access::policy& policy = state_.rights.policy();
  if (!policy.in_use()) return {.who = policy.anonymous()};
  const bool for_stop = shown.path == stop_path && policy.anonymous_may_stop();
  if (!shown.token.empty()) {
    const auto who = policy.find(shown.token, shown.in_url);
    if (who || ROWE_MUTANT(role_token)) return {.who = who.value_or(policy.anonymous())};
    // A button whose token was taken away still stops.
    if (for_stop) return {.who = policy.anonymous()};
    return unknown_token(shown.in_url ? "send it in the header Authorization; in a URL only tokens with "
                                        "`token_in_url` are accepted"
                                      : "ask whoever runs this endpoint for one");
  }
  if (const auto who = policy.find_certificate(shown.certificate)) return {.who = *who};
  const bool by_address = policy.local().role != access::nobody || ROWE_MUTANT(role_local);
  if (is_loopback(shown.address) && by_address) return {.who = policy.local()};
  if (for_stop) return {.who = policy.anonymous()};
  return {.status = 401,
          .what = "this endpoint needs a token",
          .remedy = "send `Authorization: Bearer TOKEN`, or offer the subprotocol `rowe.token.TOKEN` beside "
                    "another one"};
}

admit_answer access_control::may_log_in(const credentials& shown) const noexcept {
  const access::policy& policy = state_.rights.policy();
  if (!policy.in_use())
    return {.status = 409, .what = "no identities are configured here", .remedy = "connect without a token"};
  if (shown.token.empty())
    return {.status = 400, .what = "the form has no token, or is malformed", .remedy = "type the token in"};
  if (const auto who = policy.find(shown.token, shown.in_url)) return {.who = *who};
  return unknown_token("try again, or ask whoever runs this endpoint for one");
}

admit_answer access_control::may_call(const credentials& shown, std::string_view service) noexcept {
  const admit_answer admitted = admit(shown);
  const access::policy& policy = state_.rights.policy();
  if (admitted.status != 0 || !policy.in_use()) return admitted;
  if (policy.allows(admitted.who.role, access::right::call, service)) return admitted;
  return forbid(admitted.who, access::right::call, service,
                "show the token of a role whose `call` includes /rowe/stats");
}

admit_answer access_control::may_subscribe(const credentials& shown, std::string_view topic) noexcept {
  const admit_answer admitted = admit(shown);
  if (admitted.status != 0 || state_.rights.allow(admitted.who, access::right::subscribe, topic))
    return admitted;
  return forbid(admitted.who, access::right::subscribe, topic,
                "show the token of a role whose `subscribe` includes the topic");
}

admit_answer access_control::forbid(access::subject who, access::right what, std::string_view name,
                                    std::string_view remedy) noexcept {
  state_.counts.add(counter::denied);
  wire::text_out why{denial_};
  write_denial(why, who, what).add(" ").add_name(name, denied_name_bytes_shown);
  return {.status = 403, .what = "%", .remedy = remedy, .value = why.text()};
}

bool access_control::decide(connection& c, const wire::request& asked) noexcept {
  const auto wanted = needed_for(asked);
  const access::policy& policy = state_.rights.policy();
  if (wanted) state_.cycle.work_bytes += policy.patterns(c.who.role, wanted->right) * pattern_work_bytes;
  if (!wanted || state_.rights.allow(c, wanted->right, wanted->name)) return true;
  if (ROWE_MUTANT(role_denied)) return true;
  // Everyone may stop. What comes here finds no stop.
  if (asked.what == wire::verb::call && peer_rights::is_for_everyone(asked.service)) {
    refusals_.refuse_unknown(c, asked);
    return false;
  }
  wire::text_of<event_text_bytes_max> why;
  write_denial(why, c.who, wanted->right).add(" ");
  wanted->name.empty() ? why.add("plain messages") : why.add_name(wanted->name, denied_name_bytes_shown);
  refusals_.deny(c, asked, why.text());
  return false;
}

bool access_control::may_set(const connection& c, std::string_view parameter,
                             wire::text_out& why) const noexcept {
  state_.cycle.work_bytes +=
      state_.rights.policy().patterns(c.who.role, access::right::set) * pattern_work_bytes;
  if (state_.rights.allow(c, access::right::set, parameter)) return true;
  write_denial(why, c.who, access::right::set).add(" ").add_name(parameter, denied_name_bytes_shown);
  return false;
}

wire::text_out& access_control::write_denial(wire::text_out& into, access::subject who,
                                             access::right what) const noexcept {
  const access::policy& policy = state_.rights.policy();
  const std::string_view name = policy.identity_name(who.identity);
  if (!name.empty()) into.add(name).add(", ");
  into.add("role ").add(policy.role_name(who.role)).add(name.empty() ? "" : ",");
  return into.add(" has no right to ").add(name_of(what));
}

void access_control::report_denial(connection& c, access::right what) noexcept {
  state_.counts.add(counter::denied);
  wire::text_of<event_text_bytes_max> why;
  if (state_.rights.apply_to(c))
    write_denial(why, c.who, what);
  else
    why.add("without roles only peers on this machine may ").add(name_of(what));
  refusals_.report(c, event::kind::denied, why.text(), {});
}

} // namespace rowe::service
