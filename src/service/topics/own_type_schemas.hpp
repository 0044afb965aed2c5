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

namespace told = service::told;

template <>
inline constexpr auto names<told::motion> = enumerators<told::motion::running, told::motion::stopped>{};
template <>
inline constexpr auto names<told::cause> =
    enumerators<told::cause::start, told::cause::request, told::cause::guard, told::cause::loop,
                told::cause::service>{};

template <>
inline constexpr auto schema<told::anything> = fields<>{};
template <detail::name_literal Name>
inline constexpr auto schema<told::one_text<Name>> = fields<field<&told::one_text<Name>::text, Name>>{};
template <detail::name_literal Name>
inline constexpr auto schema<told::one_list<Name>> = fields<field<&told::one_list<Name>::texts, Name>>{};

#define ROWE_MEMBER(name, group, meaning) , &told::counts::name
template <>
inline constexpr auto schema<told::counts> = told::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#define ROWE_IF_loss(name) , &told::counts::name
#define ROWE_IF_chosen(name) , &told::counts::name
#define ROWE_IF_flow(name)
#define ROWE_IF_refusal(name)
#define ROWE_IF_own(name)
#define ROWE_MEMBER(name, group, meaning) ROWE_IF_##group(name)
template <>
inline constexpr auto schema<told::losses> = told::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#undef ROWE_IF_loss
#undef ROWE_IF_chosen
#undef ROWE_IF_flow
#undef ROWE_IF_refusal
#undef ROWE_IF_own

template <>
inline constexpr auto schema<told::bounds> =
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
inline constexpr auto schema<told::granted> =
    fields<&told::granted::fifo, &told::granted::pinned, &told::granted::locked>{};
template <>
inline constexpr auto schema<told::topic_row> =
    fields<&told::topic_row::topic, &told::topic_row::type, &told::topic_row::messages,
           &told::topic_row::rate_hz, &told::topic_row::bytes, &told::topic_row::gap_ms_max,
           &told::topic_row::subscribers>{};
template <>
inline constexpr auto schema<told::stats> =
    fields<&told::stats::name, &told::stats::epoch, &told::stats::uptime_s, &told::stats::peers,
           &told::stats::real_time, &told::stats::rates_over_s, &told::stats::topics,
           &told::stats::topics_left_out, &told::stats::losses, &told::stats::cycle_us_max>{}
        .type("rowe/Stats");
template <>
inline constexpr auto schema<told::connection_row> =
    fields<&told::connection_row::address, &told::connection_row::identity,
           &told::connection_row::identity_role, &told::connection_row::role,
           field<&told::connection_row::format, "dialect">,
           field<&told::connection_row::takes_messages, "plain">, &told::connection_row::since_s,
           &told::connection_row::silent_s, &told::connection_row::messages_in,
           &told::connection_row::messages_out, &told::connection_row::queued, &told::connection_row::blocked,
           &told::connection_row::subscriptions, &told::connection_row::calls>{};
template <>
inline constexpr auto schema<told::all_stats> =
    fields<&told::stats::name, &told::stats::epoch, &told::stats::uptime_s, &told::stats::peers,
           &told::stats::real_time, &told::stats::rates_over_s, &told::stats::topics,
           &told::stats::topics_left_out, &told::stats::losses, &told::stats::cycle_us_max,
           &told::all_stats::connections, &told::all_stats::connections_left_out, &told::all_stats::counters,
           &told::all_stats::limits>{};

template <>
inline constexpr auto schema<told::stop_request> =
    fields<&told::stop_request::source, &told::stop_request::reason>{};
template <>
inline constexpr auto schema<told::stop_answer> =
    fields<field<&told::stop_answer::state>.by_name(), &told::stop_answer::number,
           field<&told::stop_answer::cause>.by_name(), &told::stop_answer::source,
           field<&told::stop_answer::accepted_ns>.as_string(),
           field<&told::stop_answer::observed_ns>.as_string()>{};
template <>
inline constexpr auto schema<told::reset_request> =
    fields<&told::reset_request::number, &told::reset_request::tick>{};
template <>
inline constexpr auto schema<told::reset_answer> =
    fields<field<&told::reset_answer::state>.by_name(), &told::reset_answer::number,
           &told::reset_answer::refused, &told::reset_answer::right>{};
template <>
inline constexpr auto schema<told::heartbeat> =
    fields<&told::heartbeat::guard, &told::heartbeat::tick, &told::heartbeat::resign>{};
template <>
inline constexpr auto schema<told::heartbeat_answer> =
    fields<field<&told::heartbeat_answer::state>.by_name(), &told::heartbeat_answer::number,
           &told::heartbeat_answer::timeout_ms, &told::heartbeat_answer::tick,
           &told::heartbeat_answer::refused, &told::heartbeat_answer::right>{};
template <>
inline constexpr auto schema<told::guard_row> =
    fields<&told::guard_row::name, &told::guard_row::age_ms, &told::guard_row::fresh>{};
template <>
inline constexpr auto schema<told::loop_row> =
    fields<&told::loop_row::name, &told::loop_row::age_ms, &told::loop_row::acknowledged>{};
template <>
inline constexpr auto schema<told::stop_state> =
    fields<field<&told::stop_state::state>.by_name(), &told::stop_state::number,
           field<&told::stop_state::cause>.by_name(), &told::stop_state::source, &told::stop_state::since_ms,
           &told::stop_state::tick, &told::stop_state::unguarded, &told::stop_state::guards,
           &told::stop_state::loops>{}
        .type("rowe/StopState");

template <>
inline constexpr auto
    schema<told::parameter_values> = fields<&told::parameter_values::values>{}.type("rowe/Parameters");
template <>
inline constexpr auto schema<told::types_request> = fields<&told::types_request::from>{};
template <>
inline constexpr auto schema<told::type_row> =
    fields<&told::type_row::topic, &told::type_row::service, &told::type_row::type, &told::type_row::message,
           &told::type_row::request, &told::type_row::answer>{};
template <>
inline constexpr auto schema<told::types_answer> =
    fields<&told::types_answer::types, &told::types_answer::next>{};

template <>
inline constexpr auto schema<told::ros_version> =
    fields<&told::ros_version::version, &told::ros_version::distro>{};
template <>
inline constexpr auto schema<told::services> = fields<&told::services::services, &told::services::left_out>{};
template <>
inline constexpr auto schema<told::topics_and_types> =
    fields<&told::topics_and_types::topics, &told::topics_and_types::types,
           &told::topics_and_types::left_out>{};
template <>
inline constexpr auto schema<told::topics_and_raw_types> =
    fields<&told::topics_and_raw_types::topics, &told::topics_and_raw_types::types,
           &told::topics_and_raw_types::typedefs_full_text>{};
template <>
inline constexpr auto schema<told::node_details> =
    fields<&told::node_details::subscribing, &told::node_details::publishing,
           &told::node_details::services>{};
template <>
inline constexpr auto schema<told::time_now> =
    fields<&told::time_now::secs, &told::time_now::nsecs, &told::time_now::sec, &told::time_now::nanosec>{};
template <>
inline constexpr auto schema<told::get_time> = fields<&told::get_time::time>{};
template <>
inline constexpr auto schema<told::type_definition> =
    fields<&told::type_definition::type, &told::type_definition::fieldnames,
           &told::type_definition::fieldtypes, &told::type_definition::fieldarraylen,
           &told::type_definition::examples, &told::type_definition::constnames,
           &told::type_definition::constvalues>{}
        .type("rosapi/TypeDef");
template <>
inline constexpr auto schema<told::type_definitions> = fields<&told::type_definitions::typedefs>{};
template <>
inline constexpr auto schema<told::get_param> =
    fields<&told::get_param::name, field<&told::get_param::default_value, "default">>{};
template <>
inline constexpr auto schema<told::param> =
    fields<&told::param::value, &told::param::successful, &told::param::reason>{};
template <>
inline constexpr auto schema<told::set_param> = fields<&told::set_param::name, &told::set_param::value>{};
template <>
inline constexpr auto schema<told::is_done> = fields<&told::is_done::successful, &told::is_done::reason>{};
template <>
inline constexpr auto schema<told::exists> = fields<&told::exists::exists>{};

} // namespace rowe
