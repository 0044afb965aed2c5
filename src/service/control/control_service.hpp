// SPDX-License-Identifier: Apache-2.0
// The service /rowe/control: who wants to drive, and the answer; and the text of the state of control.
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include "service/control/command_gate.hpp"
#include "service/incoming/access_control.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct control_service_needs {
  core_state& state_;
  const stop_rules& stop_rules_;
  access_control& access_control_;
  command_gate& command_gate_;
};

class control_service : control_service_needs {
 public:
  explicit control_service(const control_service_needs& parts) noexcept : control_service_needs{parts} {}

  // What became of a request.
  struct decision {
    driven_index topic{}; // none: there is no such topic
    driver_rules::refusal refused = driver_rules::refusal::none;
    access::right needed = access::right::publish; // refused for want of it: role
    bool own = false;                              // who asked drives
  };
  // Carries out a request. `args`: a JSON object, or nothing. `c`: the peer; null: this process asks.
  decision carry_out(connection* c, std::string_view args) noexcept;
  void write_answer(json::writer& into, const decision& made) const noexcept;

  // The state as its topic has it: docs/drive.md.
  void write_state(json::writer& into) const noexcept;
};

} // namespace rowe::service
