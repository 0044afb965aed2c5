// SPDX-License-Identifier: Apache-2.0
// What happened that one wants a recording of: found in the endpoint's own topics, which are recorded with
// the others. One ordinary thread; allocates.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace rowe::recording {

class triggers {
 public:
  static constexpr std::string_view stop_topic = "/rowe/stop/state";
  static constexpr std::string_view control_topic = "/rowe/control/state";

  // What this message of a topic says has happened: "stop", "lease"; nothing: nothing, or it is another
  // topic's. The state that was there before the first message is no news.
  std::optional<std::string> in(std::string_view topic, std::string_view json);

 private:
  std::optional<std::string> in_stop_state(std::string_view json);
  std::optional<std::string> in_control_state(std::string_view json);

  std::optional<bool> running_;
  std::map<std::string, bool, std::less<>> in_force_; // the command of each driven topic
};

} // namespace rowe::recording
