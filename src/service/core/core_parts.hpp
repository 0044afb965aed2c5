// SPDX-License-Identifier: Apache-2.0
// The parts of the core, and what each is given. A part is made after the parts that it calls, and knows no
// others. Service thread only.
#pragma once
#include <cstddef>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/calls/long_calls.hpp"
#include "service/calls/service_providers.hpp"
#include "service/control/command_gate.hpp"
#include "service/control/control_service.hpp"
#include "service/graph/connection_graph.hpp"
#include "service/graph/graph_services.hpp"
#include "service/graph/listings.hpp"
#include "service/graph/type_services.hpp"
#include "service/handles/handle_registry.hpp"
#include "service/handles/handle_submissions.hpp"
#include "service/handles/long_publications.hpp"
#include "service/handles/thread_submissions.hpp"
#include "service/incoming/access_control.hpp"
#include "service/incoming/fragment_ingress.hpp"
#include "service/incoming/ingress.hpp"
#include "service/incoming/liveness.hpp"
#include "service/incoming/long_ingress.hpp"
#include "service/incoming/receiver.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/long_deliveries.hpp"
#include "service/outgoing/long_outbox.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/sender.hpp"
#include "service/outgoing/subscription_queues.hpp"
#include "service/parameters/parameter_requests.hpp"
#include "service/parameters/parameter_services.hpp"
#include "service/parameters/parameters.hpp"
#include "service/parameters/parameters_feed.hpp"
#include "service/reports/clock_feed.hpp"
#include "service/reports/control_feed.hpp"
#include "service/reports/metrics_report.hpp"
#include "service/reports/own_pages.hpp"
#include "service/reports/statistics_feed.hpp"
#include "service/reports/statistics_report.hpp"
#include "service/requests/call_requests.hpp"
#include "service/requests/call_router.hpp"
#include "service/requests/dispatcher.hpp"
#include "service/requests/endpoint_services.hpp"
#include "service/requests/registrations.hpp"
#include "service/requests/request_router.hpp"
#include "service/requests/revocation.hpp"
#include "service/requests/rights_service.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/stop/stop_service.hpp"
#include "service/stop/stop_state_feed.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/advertisements.hpp"
#include "service/topics/audiences.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/publish_predictor.hpp"
#include "service/topics/subscriptions.hpp"
#include "service/topics/topic_handles.hpp"
#include "service/topics/topic_pages.hpp"
#include "service/topics/topic_places.hpp"
#include "service/topics/topic_rates.hpp"
#include "service/topics/value_publisher.hpp"

namespace rowe::service {

class core_parts {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;

  // `with_threads` is shared with other threads. `memory` has footprint_bytes() left; time begins at `start`.
  core_parts(rt::arena& memory, const core_options& options, const shared_parts& with_threads,
             const core_seams& seams, frame_handler& handler, rt::time_point start) noexcept;

 protected:
  // Names a structure that is not consistent; empty: all are.
  std::string_view inconsistency() const noexcept;

  core_state state_;
  const topic_id statistics_topic_; // a server's own; a client's handles get its server's
  const topic_id stop_topic_;       // the state of the stop
  topic_rates topic_rates_;
  message_store message_store_;
  outbox outbox_;
  long_outbox long_outbox_;
  subscription_queues subscription_queues_;
  sender sender_;
  refusals refusals_;
  access_control access_control_;
  stop_options stop_options_{settled(state_.options.stop, false)}; // until the thread is described
  stop_rules stop_rules_;
  command_gate command_gate_;
  control_service control_service_;
  rights_service rights_service_;
  parameters parameters_;
  parameter_requests parameter_requests_;
  local_delivery local_delivery_;
  long_deliveries long_deliveries_;
  receiver receiver_;
  ingress ingress_;
  long_ingress long_ingress_;
  fragment_ingress fragment_ingress_;
  direct_messages direct_messages_;
  liveness liveness_;
  call_completion call_completion_;
  long_calls long_calls_;
  publish_predictor publish_predictor_;
  audiences audiences_;
  advertisement_table advertisement_table_;
  topic_places topic_places_;
  subscriptions subscriptions_;
  advertisements advertisements_;
  broker broker_;
  topic_handles topic_handles_;
  service_directory service_directory_;
  service_providers service_providers_;
  stop_service stop_service_;
  statistics_report statistics_report_;
  metrics_report metrics_report_;
  topic_pages topic_pages_;
  own_pages own_pages_;
  statistics_feed statistics_feed_;
  parameters_feed parameters_feed_;
  clock_feed clock_feed_;
  control_feed control_feed_;
  connection_graph connection_graph_;
  parameter_services parameter_services_;
  graph_services graph_services_;
  type_services type_services_;
  endpoint_services endpoint_services_;
  call_requests call_requests_;
  call_router call_router_;
  listings listings_;
  registrations registrations_;
  revocation revocation_;
  stop_state_feed stop_state_feed_;
  value_publisher value_publisher_;
  long_publications long_publications_;
  handle_submissions handle_submissions_;
  thread_submissions thread_submissions_;
  handle_registry handle_registry_;
  request_router request_router_;
  dispatcher dispatcher_;

 private:
  topic_id own_topic(std::string_view name) noexcept; // of the endpoint itself
  bool check_holders() const noexcept;
};

} // namespace rowe::service
