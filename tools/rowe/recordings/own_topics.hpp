// SPDX-License-Identifier: Apache-2.0
// What stands in recordings besides the robot's own messages.
#pragma once
#include <string_view>

namespace rowe::tools {

// Topics below it are an endpoint's own: nobody may publish there.
inline constexpr std::string_view own_topics = "/rowe/";
// What a recording says of messages that it has not: {"topic":NAME,"messages":N}.
inline constexpr std::string_view lost_topic = "/rowe/record/lost";
inline constexpr std::string_view stop_state_topic = "/rowe/stop/state"; // docs/stop.md

inline constexpr std::string_view json_encoding = "json";

} // namespace rowe::tools
