// SPDX-License-Identifier: Apache-2.0
// What a recording says of itself and its robot: when the robot was stopped, and which messages are missing.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

// An emergency stop, as /rowe/stop/state has told it.
struct recorded_stop {
  std::uint64_t number = 0;
  std::string cause{};
  std::string source{};
  std::int64_t seen_ns = 0;
  std::int64_t until_ns = 0; // when it had ended; 0: not before the end
};

// Takes the next message of that topic, in the order of the times.
void note_stop_state(json_value state, std::int64_t time_ns, std::vector<recorded_stop>& into);

// A message of /rowe/record/lost: of this topic so many are missing before it.
struct recorded_loss {
  std::string topic;
  std::uint64_t messages = 0;
};
// Nothing: it says of none.
std::optional<recorded_loss> loss_in(json_value said);

} // namespace rowe::tools
