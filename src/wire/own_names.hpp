// SPDX-License-Identifier: Apache-2.0
// The endpoint's own names, for all codecs: the topics that it publishes and the services that it answers.
// Also the two spellings of any name: ROS resolves "odom" to "/odom". Pure functions.
#pragma once
#include <string_view>

namespace rowe::wire {

inline constexpr std::string_view stats_name = "/rowe/stats"; // a topic and a service
inline constexpr std::string_view stop_name = "/rowe/stop"; // a service, and a topic on which a message stops
inline constexpr std::string_view stop_reset_name = "/rowe/stop/reset";
inline constexpr std::string_view stop_lease_name = "/rowe/stop/lease";
inline constexpr std::string_view stop_state_name = "/rowe/stop/state"; // a topic and a service

// Services that ROS's clients call on their server.
inline constexpr std::string_view list_topics_name = "/rosapi/topics";
inline constexpr std::string_view list_services_name = "/rosapi/services";
inline constexpr std::string_view topic_type_name = "/rosapi/topic_type";
inline constexpr std::string_view publishers_name = "/rosapi/publishers";
inline constexpr std::string_view service_type_name = "/rosapi/service_type";

// For topics and services: "/odom" and "odom" are the same name, "//odom" is another one, and a lone "/"
// stays as it is.
constexpr bool has_slash(std::string_view name) noexcept { return name.starts_with('/'); }
constexpr std::string_view without_slash(std::string_view name) noexcept {
  if (name.size() > 1 && has_slash(name)) name.remove_prefix(1);
  return name;
}

// Whether the endpoint itself publishes the topic, or answers the service.
constexpr bool is_own_name(std::string_view name) noexcept {
  return without_slash(name).starts_with("rowe/");
}

} // namespace rowe::wire
