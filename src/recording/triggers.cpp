// SPDX-License-Identifier: Apache-2.0
#include "recording/triggers.hpp"

#include <utility>

#include <rowe/json_value.hpp>

namespace rowe::recording {

std::optional<std::string> triggers::in(std::string_view topic, std::string_view json) {
  if (topic == stop_topic) return in_stop_state(json);
  if (topic == control_topic) return in_control_state(json);
  return std::nullopt;
}

std::optional<std::string> triggers::in_stop_state(std::string_view json) {
  const auto read = json_value::parse(json);
  const auto state = read ? read->get<std::string>("state") : json_value{}.get<std::string>("state");
  if (!state) return std::nullopt;
  const bool runs = *state == "running";
  const bool stopped = running_ && *running_ && !runs;
  running_ = runs;
  return stopped ? std::optional<std::string>{"stop"} : std::nullopt;
}

// A lease has ended when somebody drives and the newest command is older than it: the driver, or what is
// between, is silent. Who lets go has nobody driving.
std::optional<std::string> triggers::in_control_state(std::string_view json) {
  const auto read = json_value::parse(json);
  if (!read) return std::nullopt;
  bool ended = false;
  for (const json_value one : read->find("topics").value_or(json_value{}).elements()) {
    const auto name = one.get<std::string>("topic");
    if (!name) continue;
    const auto lease_ms = one.get<double>("lease_ms");
    const auto age_ms = one.get<double>("age_ms");
    const bool driven = one.get<std::string>("driver").has_value();
    const bool in_force = driven && lease_ms && age_ms && *age_ms <= *lease_ms;
    bool& before = in_force_[*name];
    ended |= before && driven && !in_force;
    before = in_force;
  }
  return ended ? std::optional<std::string>{"lease"} : std::nullopt;
}

} // namespace rowe::recording
