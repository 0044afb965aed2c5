// SPDX-License-Identifier: Apache-2.0
// The endpoint's own names, for all codecs: the topics that it publishes and the services that it answers.
// Also the two spellings of any name: ROS resolves "odom" to "/odom". Pure functions.
#pragma once
#include <cstdint>
#include <string_view>

namespace rowe::wire {

inline constexpr std::string_view stats_name = "/rowe/stats";           // a topic and a service
inline constexpr std::string_view parameters_name = "/rowe/parameters"; // a topic
inline constexpr std::string_view limit_parameters = "/rowe/limits/";   // parameters are below these
inline constexpr std::string_view counter_parameters = "/rowe/counters/";
inline constexpr std::string_view stop_name = "/rowe/stop"; // a service, and a topic on which a message stops
inline constexpr std::uint32_t stop_service_number = 1;     // where a codec numbers services
inline constexpr std::string_view stop_reset_name = "/rowe/stop/reset";
inline constexpr std::string_view stop_guard_name = "/rowe/stop/guard";
inline constexpr std::string_view stop_state_name = "/rowe/stop/state"; // a topic and a service

inline constexpr std::string_view control_name = "/rowe/control";             // a service
inline constexpr std::string_view control_state_name = "/rowe/control/state"; // a topic

inline constexpr std::string_view types_name = "/rowe/types";   // a service
inline constexpr std::string_view rights_name = "/rowe/rights"; // a service
inline constexpr std::string_view record_name = "/rowe/record"; // a service

// Paths of HTTP that the endpoint answers itself, as it does those below /rowe/.
inline constexpr std::string_view metrics_path = "/metrics";
inline constexpr std::string_view health_path = "/healthz";
inline constexpr std::string_view api_prefix = "/api/v1/";
inline constexpr std::string_view stats_path = "/api/v1/stats";
inline constexpr std::string_view topics_prefix = "/api/v1/topics/"; // behind it a topic, percent-encoded

// Services that ROS's clients call on their server.
inline constexpr std::string_view list_topics_name = "/rosapi/topics";
inline constexpr std::string_view list_services_name = "/rosapi/services";
inline constexpr std::string_view topic_type_name = "/rosapi/topic_type";
inline constexpr std::string_view publishers_name = "/rosapi/publishers";
inline constexpr std::string_view service_type_name = "/rosapi/service_type";
inline constexpr std::string_view nodes_name = "/rosapi/nodes";
inline constexpr std::string_view node_details_name = "/rosapi/node_details";
inline constexpr std::string_view topics_for_type_name = "/rosapi/topics_for_type";
inline constexpr std::string_view services_for_type_name = "/rosapi/services_for_type";
inline constexpr std::string_view subscribers_name = "/rosapi/subscribers";
inline constexpr std::string_view service_providers_name = "/rosapi/service_providers";
inline constexpr std::string_view service_node_name = "/rosapi/service_node";
inline constexpr std::string_view service_host_name = "/rosapi/service_host";
inline constexpr std::string_view interfaces_name = "/rosapi/interfaces";
inline constexpr std::string_view ros_version_name = "/rosapi/get_ros_version";
inline constexpr std::string_view action_type_name = "/rosapi/action_type";
inline constexpr std::string_view goal_details_name = "/rosapi/action_goal_details";
inline constexpr std::string_view result_details_name = "/rosapi/action_result_details";
inline constexpr std::string_view feedback_details_name = "/rosapi/action_feedback_details";
inline constexpr std::string_view action_servers_name = "/rosapi/action_servers";
inline constexpr std::string_view topics_and_raw_types_name = "/rosapi/topics_and_raw_types";
inline constexpr std::string_view get_time_name = "/rosapi/get_time";
inline constexpr std::string_view message_details_name = "/rosapi/message_details";
inline constexpr std::string_view request_details_name = "/rosapi/service_request_details";
inline constexpr std::string_view response_details_name = "/rosapi/service_response_details";
inline constexpr std::string_view get_param_names_name = "/rosapi/get_param_names";
inline constexpr std::string_view get_param_name = "/rosapi/get_param";
inline constexpr std::string_view set_param_name = "/rosapi/set_param";
inline constexpr std::string_view has_param_name = "/rosapi/has_param";
inline constexpr std::string_view search_param_name = "/rosapi/search_param";
inline constexpr std::string_view delete_param_name = "/rosapi/delete_param";

// For topics and services: "/odom" and "odom" are the same name, "//odom" is another one, and a lone "/"
// stays as it is.
constexpr bool has_slash(std::string_view name) noexcept { return name.starts_with('/'); }
constexpr std::string_view without_slash(std::string_view name) noexcept {
  if (name.size() > 1 && has_slash(name)) name.remove_prefix(1);
  return name;
}

// Whether it may be one of the services that ROS's clients call on their server.
constexpr bool is_of_rosapi(std::string_view name) noexcept {
  return without_slash(name).starts_with("rosapi/");
}

// Whether the endpoint itself publishes the topic, or answers the service.
constexpr bool is_own_name(std::string_view name) noexcept {
  return without_slash(name).starts_with("rowe/");
}

} // namespace rowe::wire
