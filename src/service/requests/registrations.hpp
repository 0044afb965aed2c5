// SPDX-License-Identifier: Apache-2.0
// Requests that outlast their message: what a peer subscribes to, advertises and provides, and which reports
// it wants. Each goes to the part that stores it, and all of a peer's end when it leaves. Service thread
// only; nothing waits or allocates.
#pragma once
#include <cassert>

#include "service/calls/service_providers.hpp"
#include "service/graph/connection_graph.hpp"
#include "service/parameters/parameter_requests.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/advertisements.hpp"
#include "service/topics/subscriptions.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct registrations_needs {
  parameter_requests& parameter_requests_;
  subscriptions& subscriptions_;
  advertisements& advertisements_;
  service_providers& service_providers_;
  connection_graph& connection_graph_;
};

class registrations : registrations_needs {
 public:
  explicit registrations(const registrations_needs& parts) noexcept : registrations_needs{parts} {}

  // A request other than a message, a call or an answer. The peer has the right to ask.
  void carry_out(connection& c, const wire::request& asked) noexcept {
    switch (asked.what) {
    case wire::verb::subscribe: return subscriptions_.subscribe(c, asked);
    case wire::verb::unsubscribe: return subscriptions_.unsubscribe(c, asked);
    case wire::verb::advertise: return (void)advertisements_.advertise(c, asked);
    case wire::verb::unadvertise: return advertisements_.unadvertise(c, asked);
    case wire::verb::advertise_action:
    case wire::verb::advertise_service: return service_providers_.advertise(c, asked);
    case wire::verb::unadvertise_action:
    case wire::verb::unadvertise_service: return service_providers_.unadvertise(c, asked);
    case wire::verb::get_parameters: return parameter_requests_.get(c, asked);
    case wire::verb::set_parameters: return parameter_requests_.set(c, asked);
    case wire::verb::subscribe_parameters: return parameter_requests_.subscribe(c, asked);
    case wire::verb::unsubscribe_parameters: return parameter_requests_.unsubscribe(c, asked);
    case wire::verb::subscribe_graph: return connection_graph_.subscribe(c, asked);
    case wire::verb::unsubscribe_graph: return connection_graph_.unsubscribe({c.id.index});
    case wire::verb::message:
    case wire::verb::publish:
    case wire::verb::call:
    case wire::verb::reply:
    case wire::verb::send_goal:
    case wire::verb::cancel_goal:
    case wire::verb::goal_feedback:
    case wire::verb::goal_result:
    case wire::verb::status:
    case wire::verb::set_level:
    case wire::verb::unsupported:
    case wire::verb::fragment:
    case wire::verb::unknown: break;
    }
    assert(false); // the dispatcher carries these out
  }
  // What a peer publishes with a type, or latched, it advertises by that. False: it may not, and a status
  // said so.
  bool registers(connection& c, const wire::request& asked) noexcept {
    return (!asked.latch && asked.type.empty()) || advertisements_.advertise_published(c, asked);
  }
  // Its services are taken out of the directory before this, when nobody may call them any more.
  void forget(peer_index peer) noexcept {
    subscriptions_.forget(peer);
    advertisements_.forget(peer);
    parameter_requests_.forget(peer);
    connection_graph_.forget(peer);
  }

 private:
};

} // namespace rowe::service
