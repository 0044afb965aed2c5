// SPDX-License-Identifier: Apache-2.0
// The services by which ROS's clients read and write parameters. Values are texts that hold JSON, as there.
// Who may call `/rosapi/get_param` may read all; to write one takes the right `set` for its name. Service
// thread only; nothing waits or allocates.
#pragma once
#include <string_view>

#include "service/calls/call_completion.hpp"
#include "service/incoming/access_control.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/parameters/parameters.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct parameter_services_needs {
  core_state& state_;
  access_control& access_control_;
  outbox& outbox_;
  call_completion& call_completion_;
  parameters& parameters_;
};

class parameter_services : parameter_services_needs {
 public:
  explicit parameter_services(const parameter_services_needs& parts) noexcept
      : parameter_services_needs{parts} {}

  // Whether the service of this full name is one of them.
  static bool answers(std::string_view service) noexcept;
  // Answers the call, and so ends it.
  void answer(call_index call, std::string_view service, const wire::call_args& what) noexcept;

 private:
  template <class Write>
  void complete(call_index call, Write&& write) noexcept;
  void fail(call_index call, std::string_view why) noexcept;
  void list(call_index call) noexcept;
  void search(call_index call, std::string_view name) noexcept;
  void get(call_index call, const wire::call_args& what, std::string_view name) noexcept;
  void set(call_index call, const wire::call_args& what, std::string_view name) noexcept;
  void write_quoted_value(parameter_id which, json::writer& into) noexcept;
};

} // namespace rowe::service
