// SPDX-License-Identifier: Apache-2.0
// The schemas of the structs in own_type_structs.hpp: the members in the order in which they are sent. For
// own_types.cpp only.
#pragma once
#include <rowe/schema.hpp>

#include "service/topics/own_type_structs.hpp"

namespace rowe::service::told {

// The first is left out, so that each that follows can stand behind a comma.
template <auto Nothing, auto... Members>
using members_behind = fields<Members...>;

} // namespace rowe::service::told

namespace rowe {

namespace reports = service::told;

template <>
inline constexpr auto names<reports::motion> =
    enumerators<reports::motion::running, reports::motion::stopped>{};
template <>
inline constexpr auto names<reports::cause> =
    enumerators<reports::cause::start, reports::cause::request, reports::cause::guard, reports::cause::loop,
                reports::cause::service>{};

template <>
inline constexpr auto schema<reports::anything> = fields<>{};
template <detail::name_literal Name>
inline constexpr auto schema<reports::one_text<Name>> = fields<field<&reports::one_text<Name>::text, Name>>{};
template <detail::name_literal Name>
inline constexpr auto schema<reports::one_list<Name>> =
    fields<field<&reports::one_list<Name>::texts, Name>>{};

#define ROWE_MEMBER(name, group, meaning) , &reports::counts::name
template <>
inline constexpr auto schema<reports::counts> = reports::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#define ROWE_IF_loss(name) , &reports::counts::name
#define ROWE_IF_chosen(name) , &reports::counts::name
#define ROWE_IF_flow(name)
#define ROWE_IF_refusal(name)
#define ROWE_IF_own(name)
#define ROWE_MEMBER(name, group, meaning) ROWE_IF_##group(name)
template <>
inline constexpr auto schema<reports::losses> = reports::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#undef ROWE_IF_loss
#undef ROWE_IF_chosen
#undef ROWE_IF_flow
#undef ROWE_IF_refusal
#undef ROWE_IF_own

template <>
inline constexpr auto schema<reports::bounds> =
    fields<&limits::connections_max, &limits::connections_per_address_max, &limits::handshakes_max,
           &limits::handshake_bytes, &limits::message_bytes_max, &limits::fragments_max, &limits::depth_max,
           &limits::messages_per_second_max, &limits::refusals_per_second_max,
           &limits::long_message_bytes_max, &limits::long_slots, &limits::topics_max,
           &limits::topic_bytes_max, &limits::subscriptions_max, &limits::subscriptions_per_connection_max,
           &limits::advertisements_per_connection_max, &limits::small_slots, &limits::small_slot_bytes,
           &limits::large_slots, &limits::queue_depth_max, &limits::queued_max, &limits::latched_bytes,
           &limits::services_max, &limits::calls_max, &limits::calls_per_connection_max,
           &limits::parameters_max, &limits::door_slots, &limits::door_slot_bytes, &limits::lanes_max,
           &limits::lane_bytes, &limits::events_max>{};

template <>
inline constexpr auto schema<reports::granted> =
    fields<&reports::granted::fifo, &reports::granted::pinned, &reports::granted::locked>{};
template <>
inline constexpr auto schema<reports::topic_row> =
    fields<&reports::topic_row::topic, &reports::topic_row::type, &reports::topic_row::messages,
           &reports::topic_row::rate_hz, &reports::topic_row::bytes, &reports::topic_row::gap_ms_max,
           &reports::topic_row::subscribers>{};
template <>
inline constexpr auto schema<reports::stats> =
    fields<&reports::stats::name, &reports::stats::epoch, &reports::stats::uptime_s, &reports::stats::peers,
           &reports::stats::real_time, &reports::stats::rates_over_s, &reports::stats::topics,
           &reports::stats::topics_left_out, &reports::stats::losses, &reports::stats::cycle_us_max>{}
        .type("rowe/Stats");
template <>
inline constexpr auto schema<reports::connection_row> =
    fields<&reports::connection_row::address, &reports::connection_row::identity,
           &reports::connection_row::identity_role, &reports::connection_row::role,
           field<&reports::connection_row::format, "dialect">,
           field<&reports::connection_row::takes_messages, "plain">, &reports::connection_row::since_s,
           &reports::connection_row::silent_s, &reports::connection_row::messages_in,
           &reports::connection_row::messages_out, &reports::connection_row::queued,
           &reports::connection_row::blocked, &reports::connection_row::subscriptions,
           &reports::connection_row::calls>{};
template <>
inline constexpr auto schema<reports::all_stats> =
    fields<&reports::stats::name, &reports::stats::epoch, &reports::stats::uptime_s, &reports::stats::peers,
           &reports::stats::real_time, &reports::stats::rates_over_s, &reports::stats::topics,
           &reports::stats::topics_left_out, &reports::stats::losses, &reports::stats::cycle_us_max,
           &reports::all_stats::connections, &reports::all_stats::connections_left_out,
           &reports::all_stats::counters, &reports::all_stats::limits>{};

template <>
inline constexpr auto schema<reports::stop_request> =
    fields<&reports::stop_request::source, &reports::stop_request::reason>{};
template <>
inline constexpr auto schema<reports::stop_answer> =
    fields<field<&reports::stop_answer::state>.by_name(), &reports::stop_answer::number,
           field<&reports::stop_answer::cause>.by_name(), &reports::stop_answer::source,
           field<&reports::stop_answer::accepted_ns>.as_string(),
           field<&reports::stop_answer::observed_ns>.as_string()>{};
template <>
inline constexpr auto schema<reports::reset_request> =
    fields<&reports::reset_request::number, &reports::reset_request::tick>{};
template <>
inline constexpr auto schema<reports::reset_answer> =
    fields<field<&reports::reset_answer::state>.by_name(), &reports::reset_answer::number,
           &reports::reset_answer::refused, &reports::reset_answer::right>{};
template <>
inline constexpr auto schema<reports::heartbeat> =
    fields<&reports::heartbeat::guard, &reports::heartbeat::tick, &reports::heartbeat::resign>{};
template <>
inline constexpr auto schema<reports::heartbeat_answer> =
    fields<field<&reports::heartbeat_answer::state>.by_name(), &reports::heartbeat_answer::number,
           &reports::heartbeat_answer::timeout_ms, &reports::heartbeat_answer::tick,
           &reports::heartbeat_answer::refused, &reports::heartbeat_answer::right>{};
template <>
inline constexpr auto schema<reports::guard_row> =
    fields<&reports::guard_row::name, &reports::guard_row::age_ms, &reports::guard_row::fresh>{};
template <>
inline constexpr auto schema<reports::loop_row> =
    fields<&reports::loop_row::name, &reports::loop_row::age_ms, &reports::loop_row::acknowledged>{};
template <>
inline constexpr auto schema<reports::stop_state> =
    fields<field<&reports::stop_state::state>.by_name(), &reports::stop_state::number,
           field<&reports::stop_state::cause>.by_name(), &reports::stop_state::source,
           &reports::stop_state::since_ms, &reports::stop_state::tick, &reports::stop_state::unguarded,
           &reports::stop_state::guards, &reports::stop_state::loops>{}
        .type("rowe/StopState");

template <>
inline constexpr auto
    schema<reports::parameter_values> = fields<&reports::parameter_values::values>{}.type("rowe/Parameters");
template <>
inline constexpr auto schema<reports::types_request> = fields<&reports::types_request::from>{};
template <>
inline constexpr auto schema<reports::type_row> =
    fields<&reports::type_row::topic, &reports::type_row::service, &reports::type_row::type,
           &reports::type_row::message, &reports::type_row::request, &reports::type_row::answer>{};
template <>
inline constexpr auto schema<reports::types_answer> =
    fields<&reports::types_answer::types, &reports::types_answer::next>{};

template <>
inline constexpr auto schema<reports::ros_version> =
    fields<&reports::ros_version::version, &reports::ros_version::distro>{};
template <>
inline constexpr auto schema<reports::services> =
    fields<&reports::services::services, &reports::services::left_out>{};
template <>
inline constexpr auto schema<reports::topics_and_types> =
    fields<&reports::topics_and_types::topics, &reports::topics_and_types::types,
           &reports::topics_and_types::left_out>{};
template <>
inline constexpr auto schema<reports::topics_and_raw_types> =
    fields<&reports::topics_and_raw_types::topics, &reports::topics_and_raw_types::types,
           &reports::topics_and_raw_types::typedefs_full_text>{};
template <>
inline constexpr auto schema<reports::node_details> =
    fields<&reports::node_details::subscribing, &reports::node_details::publishing,
           &reports::node_details::services>{};
template <>
inline constexpr auto schema<reports::time_now> =
    fields<&reports::time_now::secs, &reports::time_now::nsecs, &reports::time_now::sec,
           &reports::time_now::nanosec>{};
template <>
inline constexpr auto schema<reports::get_time> = fields<&reports::get_time::time>{};
template <>
inline constexpr auto schema<reports::type_definition> =
    fields<&reports::type_definition::type, &reports::type_definition::fieldnames,
           &reports::type_definition::fieldtypes, &reports::type_definition::fieldarraylen,
           &reports::type_definition::examples, &reports::type_definition::constnames,
           &reports::type_definition::constvalues>{}
        .type("rosapi/TypeDef");
template <>
inline constexpr auto schema<reports::type_definitions> = fields<&reports::type_definitions::typedefs>{};
template <>
inline constexpr auto schema<reports::get_param> =
    fields<&reports::get_param::name, field<&reports::get_param::default_value, "default">>{};
template <>
inline constexpr auto schema<reports::param> =
    fields<&reports::param::value, &reports::param::successful, &reports::param::reason>{};
template <>
inline constexpr auto schema<reports::set_param> =
    fields<&reports::set_param::name, &reports::set_param::value>{};
template <>
inline constexpr auto schema<reports::is_done> =
    fields<&reports::is_done::successful, &reports::is_done::reason>{};
template <>
inline constexpr auto schema<reports::exists> = fields<&reports::exists::exists>{};

} // namespace rowe
