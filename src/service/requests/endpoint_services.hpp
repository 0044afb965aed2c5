// SPDX-License-Identifier: Apache-2.0
// The services that the endpoint itself answers: its statistics, and what ROS's clients ask their server
// about topics and services. Those of the stop are not among them. Service thread only; nothing waits or
// allocates.
#pragma once
#include <string_view>

#include <rowe/detail/queue_pair.hpp>

#include "service/calls/call_completion.hpp"
#include "service/control/control_service.hpp"
#include "service/graph/graph_services.hpp"
#include "service/graph/type_services.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/parameters/parameter_services.hpp"
#include "service/reports/statistics_report.hpp"
#include "service/requests/rights_service.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct endpoint_services_needs {
  core_state& state_;
  outbox& outbox_;
  call_completion& call_completion_;
  statistics_report& statistics_report_;
  const graph_services& graph_services_;
  parameter_services& parameter_services_;
  type_services& type_services_;
  control_service& control_service_;
  const rights_service& rights_service_;
};

class endpoint_services : endpoint_services_needs {
 public:
  explicit endpoint_services(const endpoint_services_needs& parts) noexcept
      : endpoint_services_needs{parts} {}

  // The full name of such a service. `service`: its name in either spelling. Empty: it is none of them.
  static std::string_view find(std::string_view service) noexcept;
  // Answers the call, and so ends it. `service`: the full name.
  void answer(call_index call, std::string_view service, const wire::call_args& what) noexcept;

 private:
  void answer_control(call_index call, connection* c, const wire::call_args& what) noexcept;
  void answer_rights(call_index call, const connection* c, const wire::call_args& what) noexcept;
  void answer_record(call_index call, const wire::call_args& what) noexcept;
};

} // namespace rowe::service
