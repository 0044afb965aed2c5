// SPDX-License-Identifier: Apache-2.0
#include "service/topics/own_types.hpp"

#include <algorithm>
#include <array>

#include "service/topics/own_type_schemas.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

static_assert(describe<reports::counts>().members.size() == counter_descriptions.size());
static_assert(describe<reports::bounds>().members.size() == limit_table.size());

template <class Request, class Answer, class Listed = Answer>
consteval own_service_type typed(std::string_view name, std::string_view type) noexcept {
  return {.name = name,
          .type = type,
          .of_stop = name.starts_with(wire::stop_name),
          .request = &describe<Request>(),
          .answer = &describe<Answer>(),
          .listed = &describe<Listed>()};
}

constexpr std::array topic_types{
    own_topic_type{wire::stats_name, "rowe/Stats", &describe<reports::stats>()},
    own_topic_type{wire::stop_state_name, "rowe/StopState", &describe<reports::stop_state>()},
    own_topic_type{wire::parameters_name, "rowe/Parameters", &describe<reports::parameter_values>()},
};

// Those that have numbers come first.
constexpr std::array service_types{
    typed<reports::stop_request, reports::stop_answer>(wire::stop_name, "rowe/Stop"),
    typed<reports::reset_request, reports::reset_answer>(wire::stop_reset_name, "rowe/ResetStop"),
    typed<reports::heartbeat, reports::heartbeat_answer>(wire::stop_guard_name, "rowe/GuardStop"),
    typed<reports::anything, reports::stop_state>(wire::stop_state_name, "rowe/GetStopState"),
    typed<reports::anything, reports::all_stats, reports::stats>(wire::stats_name, "rowe/GetStats"),
    typed<reports::anything, reports::topics_and_types>(wire::list_topics_name, "rosapi/Topics"),
    typed<reports::anything, reports::services>(wire::list_services_name, "rosapi/Services"),
    typed<reports::of_topic, reports::of_type>(wire::topic_type_name, "rosapi/TopicType"),
    typed<reports::of_topic, reports::publishers>(wire::publishers_name, "rosapi/Publishers"),
    typed<reports::of_service, reports::of_type>(wire::service_type_name, "rosapi/ServiceType"),
    typed<reports::types_request, reports::types_answer>(wire::types_name, "rowe/GetTypes"),
    typed<reports::anything, reports::nodes>(wire::nodes_name, "rosapi/Nodes"),
    typed<reports::of_node, reports::node_details>(wire::node_details_name, "rosapi/NodeDetails"),
    typed<reports::of_type, reports::topics>(wire::topics_for_type_name, "rosapi/TopicsForType"),
    typed<reports::of_type, reports::services>(wire::services_for_type_name, "rosapi/ServicesForType"),
    typed<reports::of_topic, reports::subscribers>(wire::subscribers_name, "rosapi/Subscribers"),
    typed<reports::of_service, reports::providers>(wire::service_providers_name, "rosapi/ServiceProviders"),
    typed<reports::of_service, reports::of_node>(wire::service_node_name, "rosapi/ServiceNode"),
    typed<reports::of_service, reports::of_host>(wire::service_host_name, "rosapi/ServiceHost"),
    typed<reports::anything, reports::interfaces>(wire::interfaces_name, "rosapi/Interfaces"),
    typed<reports::anything, reports::ros_version>(wire::ros_version_name, "rosapi/GetROSVersion"),
    typed<reports::of_action, reports::of_type>(wire::action_type_name, "rosapi/ActionType"),
    typed<reports::anything, reports::action_servers>(wire::action_servers_name, "rosapi/GetActionServers"),
    typed<reports::anything, reports::topics_and_raw_types>(wire::topics_and_raw_types_name,
                                                            "rosapi/TopicsAndRawTypes"),
    typed<reports::anything, reports::get_time>(wire::get_time_name, "rosapi/GetTime"),
    typed<reports::of_type, reports::type_definitions>(wire::message_details_name, "rosapi/MessageDetails"),
    typed<reports::of_type, reports::type_definitions>(wire::request_details_name,
                                                       "rosapi/ServiceRequestDetails"),
    typed<reports::of_type, reports::type_definitions>(wire::response_details_name,
                                                       "rosapi/ServiceResponseDetails"),
    typed<reports::of_type, reports::type_definitions>(wire::goal_details_name, "rosapi/ActionGoalDetails"),
    typed<reports::of_type, reports::type_definitions>(wire::result_details_name,
                                                       "rosapi/ActionResultDetails"),
    typed<reports::of_type, reports::type_definitions>(wire::feedback_details_name,
                                                       "rosapi/ActionFeedbackDetails"),
    typed<reports::anything, reports::names_list>(wire::get_param_names_name, "rosapi/GetParamNames"),
    typed<reports::get_param, reports::param>(wire::get_param_name, "rosapi/GetParam"),
    typed<reports::set_param, reports::is_done>(wire::set_param_name, "rosapi/SetParam"),
    typed<reports::of_name, reports::exists>(wire::has_param_name, "rosapi/HasParam"),
    typed<reports::of_name, reports::found_name>(wire::search_param_name, "rosapi/SearchParam"),
    typed<reports::of_name, reports::anything>(wire::delete_param_name, "rosapi/DeleteParam"),
};

static_assert(service_types.size() >= numbered_own_services);
static_assert(service_types[wire::stop_service_number - 1].name == wire::stop_name);
static_assert(std::all_of(service_types.begin(), service_types.end(), [](const own_service_type& one) {
  return is_own_name(one.name) || is_of_rosapi(one.name);
}));
static_assert(service_types[numbered_own_services - 1].name == wire::service_type_name);

template <class Row>
const Row* find(std::span<const Row> all, std::string_view name) noexcept {
  const auto found = std::find_if(all.begin(), all.end(), [name](const Row& one) {
    return without_slash(one.name) == without_slash(name);
  });
  return found == all.end() ? nullptr : &*found;
}

} // namespace

std::span<const own_topic_type> own_topic_types() noexcept { return topic_types; }
std::span<const own_service_type> own_service_types() noexcept { return service_types; }

const own_topic_type* own_type_of_topic(std::string_view name) noexcept {
  return find(own_topic_types(), name);
}
const own_service_type* own_type_of_service(std::string_view name) noexcept {
  return find(own_service_types(), name);
}

void describe_own(topic_table& topics, topic_id topic) noexcept {
  const own_topic_type* const its = own_type_of_topic(topics.name(topic));
  if (its == nullptr) return;
  (void)topics.set_type(topic, its->type); // false: limits::topic_bytes_max leaves no room for it
  topics.set_schema(topic, its->message);
}

} // namespace rowe::service
