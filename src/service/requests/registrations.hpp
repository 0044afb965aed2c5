// SPDX-License-Identifier: Apache-2.0
// Requests that outlast their message: what a peer subscribes to, advertises, provides, and wants to be told.
// Each goes to the part that keeps it, and all of a peer's end when it leaves. Service thread only; nothing
// waits or allocates.
#pragma once
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
  void carry_out(connection& c, const wire::request& asked) noexcept;
  // What a peer publishes with a type, or latched, it advertises by that. False: it may not, and was told.
  bool registers(connection& c, const wire::request& asked) noexcept {
    return (!asked.latch && asked.type.empty()) || advertisements_.advertise_published(c, asked);
  }
  // Its services are taken out of the directory before this, when nobody may call them any more.
  void forget(peer_index peer) noexcept;

 private:
};

} // namespace rowe::service
