// SPDX-License-Identifier: Apache-2.0
#include "service/requests/registrations.hpp"

#include <cassert>

namespace rowe::service {

using wire::verb;

void registrations::carry_out(connection& c, const wire::request& asked) noexcept {
  switch (asked.what) {
  case verb::subscribe: return subscriptions_.subscribe(c, asked);
  case verb::unsubscribe: return subscriptions_.unsubscribe(c, asked);
  case verb::advertise: return (void)advertisements_.advertise(c, asked);
  case verb::unadvertise: return advertisements_.unadvertise(c, asked);
  case verb::advertise_action:
  case verb::advertise_service: return service_providers_.advertise(c, asked);
  case verb::unadvertise_action:
  case verb::unadvertise_service: return service_providers_.unadvertise(c, asked);
  case verb::get_parameters: return parameter_requests_.get(c, asked);
  case verb::set_parameters: return parameter_requests_.set(c, asked);
  case verb::subscribe_parameters: return parameter_requests_.subscribe(c, asked);
  case verb::unsubscribe_parameters: return parameter_requests_.unsubscribe(c, asked);
  case verb::subscribe_graph: return connection_graph_.subscribe(c, asked);
  case verb::unsubscribe_graph: return connection_graph_.unsubscribe({c.id.index});
  case verb::message:
  case verb::publish:
  case verb::call:
  case verb::reply:
  case verb::send_goal:
  case verb::cancel_goal:
  case verb::goal_feedback:
  case verb::goal_result:
  case verb::status:
  case verb::set_level:
  case verb::unsupported:
  case verb::fragment:
  case verb::unknown: break;
  }
  assert(false); // the dispatcher carries these out
}

void registrations::forget(peer_index peer) noexcept {
  subscriptions_.forget(peer);
  advertisements_.forget(peer);
  parameter_requests_.forget(peer);
  connection_graph_.forget(peer);
}

} // namespace rowe::service
