// SPDX-License-Identifier: Apache-2.0
// What a robot has, by name: its topics, services and actions, with their types, and its parameters. Also
// what other servers of rosbridge have.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service_asker.hpp"

namespace rowe::tools {

struct robot_name {
  std::string name;
  std::string type{}; // empty: it is not known
};

enum class name_kind : std::uint8_t { topic, service, action, parameter };
std::string_view word_of(name_kind which) noexcept; // "topic"

// Sorted by name; topics with their types. Nothing: the robot does not say; see service_asker::why().
// `left_out`: how many names found no room in the answer.
std::optional<std::vector<robot_name>> names_of(service_asker& robot, name_kind which,
                                                std::uint64_t* left_out = nullptr);
// Asks for the types of services or actions, one after the other. False: a signal came.
bool ask_types(service_asker& robot, name_kind which, std::vector<robot_name>& of);

// Whether it is one of those that every endpoint has.
bool is_endpoints_own(std::string_view name) noexcept;

// Who does what with a topic, or provides a service or an action, as /rosapi/ says it; nothing: it does not.
std::optional<std::vector<std::string>> holders_of(service_asker& robot, std::string_view service,
                                                   std::string_view key, std::string_view name,
                                                   std::string_view list);

// "/odom", of a topic that was typed without its slash.
std::string with_slash(std::string_view name);

// The name of `all` that `name` is most likely a slip of; empty: none is near.
std::string nearest_name(std::string_view name, const std::vector<robot_name>& all);

} // namespace rowe::tools
