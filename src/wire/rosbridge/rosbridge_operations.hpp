// SPDX-License-Identifier: Apache-2.0
// The members of rosbridge's messages, and the operations with what each asks for. For its decoder only.
#pragma once
#include <array>
#include <cstddef>
#include <iterator>
#include <string_view>

#include "wire/codec/request.hpp"
#include "wire/text/word_table.hpp"

namespace rowe::wire::rosbridge {

// The known members, but for those that only a fragment has (rosbridge_values.hpp). Those that rowe does not
// read are among them, because they must not occur twice either.
inline constexpr word_table member_names{"op",
                                         "id",
                                         "topic",
                                         "msg",
                                         "type",
                                         "level",
                                         "throttle_rate",
                                         "queue_length",
                                         "fragment_size",
                                         "latch", //
                                         "queue_size",
                                         "qos",
                                         "service",
                                         "args",
                                         "values",
                                         "result",
                                         "compression",
                                         "timeout",
                                         "ttl_ms", //
                                         "action",
                                         "action_type",
                                         "feedback",
                                         "status",
                                         "tick"};

struct operation {
  std::string_view text;
  verb what;
};
inline constexpr operation operations[] = {{"publish", verb::publish},
                                           {"subscribe", verb::subscribe},
                                           {"unsubscribe", verb::unsubscribe},
                                           {"advertise", verb::advertise},
                                           {"unadvertise", verb::unadvertise},
                                           {"status", verb::status},
                                           {"set_level", verb::set_level},
                                           {"call_service", verb::call},
                                           {"service_response", verb::reply},
                                           {"advertise_service", verb::advertise_service},
                                           {"unadvertise_service", verb::unadvertise_service},
                                           {"advertise_action", verb::advertise_action},
                                           {"unadvertise_action", verb::unadvertise_action},
                                           {"send_action_goal", verb::send_goal},
                                           {"cancel_action_goal", verb::cancel_goal},
                                           {"action_feedback", verb::goal_feedback},
                                           {"action_result", verb::goal_result},
                                           {"fragment", verb::fragment},
                                           {"action_status", verb::unsupported},
                                           {"png", verb::unsupported},
                                           {"auth", verb::unsupported}};
inline constexpr word_table<std::size(operations)> operation_names{[] {
  std::array<std::string_view, std::size(operations)> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = operations[i].text;
  return names;
}()};

} // namespace rowe::wire::rosbridge
