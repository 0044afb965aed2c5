// SPDX-License-Identifier: Apache-2.0
#include "service/topics/own_types.hpp"

#include <algorithm>
#include <array>

#include "service/topics/own_type_schemas.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

static_assert(describe<own_structs::counts>().members.size() == counter_descriptions.size());
static_assert(describe<own_structs::bounds>().members.size() == limit_table.size());

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
    own_topic_type{wire::stats_name, "rowe/Stats", &describe<own_structs::stats>()},
    own_topic_type{wire::stop_state_name, "rowe/StopState", &describe<own_structs::stop_state>()},
    own_topic_type{wire::parameters_name, "rowe/Parameters", &describe<own_structs::parameter_values>()},
    own_topic_type{wire::control_state_name, "rowe/ControlState", &describe<own_structs::control_state>()},
};

// Those that have numbers come first.
constexpr std::array service_types{
    typed<own_structs::stop_request, own_structs::stop_answer>(wire::stop_name, "rowe/Stop"),
    typed<own_structs::reset_request, own_structs::reset_answer>(wire::stop_reset_name, "rowe/ResetStop"),
    typed<own_structs::heartbeat, own_structs::heartbeat_answer>(wire::stop_guard_name, "rowe/GuardStop"),
    typed<own_structs::anything, own_structs::stop_state>(wire::stop_state_name, "rowe/GetStopState"),
    typed<own_structs::anything, own_structs::all_stats, own_structs::stats>(wire::stats_name,
                                                                             "rowe/GetStats"),
    typed<own_structs::anything, own_structs::topics_and_types>(wire::list_topics_name, "rosapi/Topics"),
    typed<own_structs::anything, own_structs::services>(wire::list_services_name, "rosapi/Services"),
    typed<own_structs::of_topic, own_structs::of_type>(wire::topic_type_name, "rosapi/TopicType"),
    typed<own_structs::of_topic, own_structs::publishers>(wire::publishers_name, "rosapi/Publishers"),
    typed<own_structs::of_service, own_structs::of_type>(wire::service_type_name, "rosapi/ServiceType"),
    typed<own_structs::types_request, own_structs::types_answer>(wire::types_name, "rowe/GetTypes"),
    typed<own_structs::anything, own_structs::nodes>(wire::nodes_name, "rosapi/Nodes"),
    typed<own_structs::of_node, own_structs::node_details>(wire::node_details_name, "rosapi/NodeDetails"),
    typed<own_structs::of_type, own_structs::topics>(wire::topics_for_type_name, "rosapi/TopicsForType"),
    typed<own_structs::of_type, own_structs::services>(wire::services_for_type_name,
                                                       "rosapi/ServicesForType"),
    typed<own_structs::of_topic, own_structs::subscribers>(wire::subscribers_name, "rosapi/Subscribers"),
    typed<own_structs::of_service, own_structs::providers>(wire::service_providers_name,
                                                           "rosapi/ServiceProviders"),
    typed<own_structs::of_service, own_structs::of_node>(wire::service_node_name, "rosapi/ServiceNode"),
    typed<own_structs::of_service, own_structs::of_host>(wire::service_host_name, "rosapi/ServiceHost"),
    typed<own_structs::anything, own_structs::interfaces>(wire::interfaces_name, "rosapi/Interfaces"),
    typed<own_structs::anything, own_structs::ros_version>(wire::ros_version_name, "rosapi/GetROSVersion"),
    typed<own_structs::of_action, own_structs::of_type>(wire::action_type_name, "rosapi/ActionType"),
    typed<own_structs::anything, own_structs::action_servers>(wire::action_servers_name,
                                                              "rosapi/GetActionServers"),
    typed<own_structs::anything, own_structs::topics_and_raw_types>(wire::topics_and_raw_types_name,
                                                                    "rosapi/TopicsAndRawTypes"),
    typed<own_structs::anything, own_structs::get_time>(wire::get_time_name, "rosapi/GetTime"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::message_details_name,
                                                               "rosapi/MessageDetails"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::request_details_name,
                                                               "rosapi/ServiceRequestDetails"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::response_details_name,
                                                               "rosapi/ServiceResponseDetails"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::goal_details_name,
                                                               "rosapi/ActionGoalDetails"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::result_details_name,
                                                               "rosapi/ActionResultDetails"),
    typed<own_structs::of_type, own_structs::type_definitions>(wire::feedback_details_name,
                                                               "rosapi/ActionFeedbackDetails"),
    typed<own_structs::anything, own_structs::names_list>(wire::get_param_names_name, "rosapi/GetParamNames"),
    typed<own_structs::get_param, own_structs::param>(wire::get_param_name, "rosapi/GetParam"),
    typed<own_structs::set_param, own_structs::is_done>(wire::set_param_name, "rosapi/SetParam"),
    typed<own_structs::of_name, own_structs::exists>(wire::has_param_name, "rosapi/HasParam"),
    typed<own_structs::of_name, own_structs::found_name>(wire::search_param_name, "rosapi/SearchParam"),
    typed<own_structs::of_name, own_structs::anything>(wire::delete_param_name, "rosapi/DeleteParam"),
    typed<own_structs::control_request, own_structs::control_answer>(wire::control_name, "rowe/Control"),
    typed<own_structs::rights_request, own_structs::rights_answer>(wire::rights_name, "rowe/Rights"),
    typed<own_structs::record_request, own_structs::record_answer>(wire::record_name, "rowe/Record"),
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
