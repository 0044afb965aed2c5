// SPDX-License-Identifier: Apache-2.0
// The schemas of the structs in own_type_structs.hpp: the members in the order in which they are sent. For
// own_types.cpp only.
#pragma once
#include <rowe/schema.hpp>

#include "service/topics/own_type_structs.hpp"

namespace rowe::service::own_structs {

// The first is left out, so that each that follows can stand behind a comma.
template <auto Nothing, auto... Members>
using members_behind = fields<Members...>;

} // namespace rowe::service::own_structs

namespace rowe {

namespace own_structs = service::own_structs;

template <>
inline constexpr auto names<own_structs::motion> =
    enumerators<own_structs::motion::running, own_structs::motion::stopped>{};
template <>
inline constexpr auto names<own_structs::cause> =
    enumerators<own_structs::cause::start, own_structs::cause::request, own_structs::cause::guard,
                own_structs::cause::loop, own_structs::cause::service>{};

template <>
inline constexpr auto schema<own_structs::anything> = fields<>{};
template <detail::name_literal Name>
inline constexpr auto schema<own_structs::one_text<Name>> =
    fields<field<&own_structs::one_text<Name>::text, Name>>{};
template <detail::name_literal Name>
inline constexpr auto schema<own_structs::one_list<Name>> =
    fields<field<&own_structs::one_list<Name>::texts, Name>>{};

#define ROWE_MEMBER(name, group, meaning) , &own_structs::counts::name
template <>
inline constexpr auto schema<own_structs::counts> =
    own_structs::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#define ROWE_IF_loss(name) , &own_structs::counts::name
#define ROWE_IF_chosen(name) , &own_structs::counts::name
#define ROWE_IF_flow(name)
#define ROWE_IF_refusal(name)
#define ROWE_IF_own(name)
#define ROWE_MEMBER(name, group, meaning) ROWE_IF_##group(name)
template <>
inline constexpr auto schema<own_structs::losses> =
    own_structs::members_behind<0 ROWE_COUNTERS(ROWE_MEMBER)>{};
#undef ROWE_MEMBER
#undef ROWE_IF_loss
#undef ROWE_IF_chosen
#undef ROWE_IF_flow
#undef ROWE_IF_refusal
#undef ROWE_IF_own

template <>
inline constexpr auto schema<own_structs::bounds> =
    fields<&limits::connections_max, &limits::connections_per_address_max, &limits::handshakes_max,
           &limits::handshake_bytes, &limits::message_bytes_max, &limits::fragments_max, &limits::depth_max,
           &limits::messages_per_second_max, &limits::refusals_per_second_max,
           &limits::long_message_bytes_max, &limits::long_slots, &limits::topics_max,
           &limits::topic_bytes_max, &limits::subscriptions_max, &limits::subscriptions_per_connection_max,
           &limits::advertisements_per_connection_max, &limits::small_slots, &limits::small_slot_bytes,
           &limits::large_slots, &limits::queue_depth_max, &limits::queued_max, &limits::latched_bytes,
           &limits::services_max, &limits::calls_max, &limits::calls_per_connection_max,
           &limits::parameters_max, &limits::door_slots, &limits::door_slot_bytes, &limits::handles_max,
           &limits::handle_bytes, &limits::events_max>{};

template <>
inline constexpr auto schema<own_structs::granted> =
    fields<&own_structs::granted::fifo, &own_structs::granted::pinned, &own_structs::granted::locked>{};
template <>
inline constexpr auto schema<own_structs::topic_row> =
    fields<&own_structs::topic_row::topic, &own_structs::topic_row::type, &own_structs::topic_row::messages,
           &own_structs::topic_row::rate_hz, &own_structs::topic_row::bytes,
           &own_structs::topic_row::gap_ms_max, &own_structs::topic_row::subscribers>{};
template <>
inline constexpr auto schema<own_structs::timing_row> =
    fields<&own_structs::timing_row::name, &own_structs::timing_row::cycles, &own_structs::timing_row::p50_us,
           &own_structs::timing_row::p99_us, &own_structs::timing_row::p999_us,
           &own_structs::timing_row::max_us, &own_structs::timing_row::bound_us>{};
template <>
inline constexpr auto schema<own_structs::stats> =
    fields<&own_structs::stats::name, &own_structs::stats::epoch, &own_structs::stats::uptime_s,
           &own_structs::stats::peers, &own_structs::stats::real_time, &own_structs::stats::rates_over_s,
           &own_structs::stats::topics, &own_structs::stats::topics_left_out, &own_structs::stats::losses,
           &own_structs::stats::cycle_us_max, &own_structs::stats::loops>{}
        .type("rowe/Stats");
template <>
inline constexpr auto schema<own_structs::connection_row> =
    fields<&own_structs::connection_row::address, &own_structs::connection_row::identity,
           &own_structs::connection_row::identity_role, &own_structs::connection_row::role,
           field<&own_structs::connection_row::format, "dialect">,
           field<&own_structs::connection_row::takes_messages, "plain">,
           &own_structs::connection_row::since_s, &own_structs::connection_row::silent_s,
           &own_structs::connection_row::messages_in, &own_structs::connection_row::messages_out,
           &own_structs::connection_row::queued, &own_structs::connection_row::blocked,
           &own_structs::connection_row::subscriptions, &own_structs::connection_row::calls>{};
template <>
inline constexpr auto schema<own_structs::all_stats> =
    fields<&own_structs::stats::name, &own_structs::stats::epoch, &own_structs::stats::uptime_s,
           &own_structs::stats::peers, &own_structs::stats::real_time, &own_structs::stats::rates_over_s,
           &own_structs::stats::topics, &own_structs::stats::topics_left_out, &own_structs::stats::losses,
           &own_structs::stats::cycle_us_max, &own_structs::stats::loops,
           &own_structs::all_stats::connections, &own_structs::all_stats::connections_left_out,
           &own_structs::all_stats::counters, &own_structs::all_stats::limits>{};

template <>
inline constexpr auto schema<own_structs::stop_request> =
    fields<&own_structs::stop_request::source, &own_structs::stop_request::reason>{};
template <>
inline constexpr auto schema<own_structs::stop_answer> =
    fields<field<&own_structs::stop_answer::state>.by_name(), &own_structs::stop_answer::number,
           field<&own_structs::stop_answer::cause>.by_name(), &own_structs::stop_answer::source,
           field<&own_structs::stop_answer::accepted_ns>.as_string(),
           field<&own_structs::stop_answer::observed_ns>.as_string()>{};
template <>
inline constexpr auto schema<own_structs::reset_request> =
    fields<&own_structs::reset_request::number, &own_structs::reset_request::tick>{};
template <>
inline constexpr auto schema<own_structs::reset_answer> =
    fields<field<&own_structs::reset_answer::state>.by_name(), &own_structs::reset_answer::number,
           &own_structs::reset_answer::refused, &own_structs::reset_answer::right>{};
template <>
inline constexpr auto schema<own_structs::heartbeat> =
    fields<&own_structs::heartbeat::guard, &own_structs::heartbeat::tick, &own_structs::heartbeat::resign>{};
template <>
inline constexpr auto schema<own_structs::heartbeat_answer> =
    fields<field<&own_structs::heartbeat_answer::state>.by_name(), &own_structs::heartbeat_answer::number,
           &own_structs::heartbeat_answer::timeout_ms, &own_structs::heartbeat_answer::tick,
           &own_structs::heartbeat_answer::refused, &own_structs::heartbeat_answer::right>{};
template <>
inline constexpr auto schema<own_structs::guard_row> =
    fields<&own_structs::guard_row::name, &own_structs::guard_row::age_ms, &own_structs::guard_row::fresh>{};
template <>
inline constexpr auto schema<own_structs::loop_row> =
    fields<&own_structs::loop_row::name, &own_structs::loop_row::age_ms,
           &own_structs::loop_row::acknowledged>{};
template <>
inline constexpr auto schema<own_structs::stop_state> =
    fields<field<&own_structs::stop_state::state>.by_name(), &own_structs::stop_state::number,
           field<&own_structs::stop_state::cause>.by_name(), &own_structs::stop_state::source,
           &own_structs::stop_state::since_ms, &own_structs::stop_state::tick,
           &own_structs::stop_state::unguarded, &own_structs::stop_state::guards,
           &own_structs::stop_state::loops>{}
        .type("rowe/StopState");

template <>
inline constexpr auto schema<own_structs::control_request> =
    fields<&own_structs::control_request::topic, &own_structs::control_request::action,
           &own_structs::control_request::name, &own_structs::control_request::tick>{};
template <>
inline constexpr auto schema<own_structs::control_answer> =
    fields<&own_structs::control_answer::topic, &own_structs::control_answer::driver,
           &own_structs::control_answer::number, &own_structs::control_answer::yours,
           &own_structs::control_answer::lease_ms, &own_structs::control_answer::hold_ms,
           &own_structs::control_answer::tick, &own_structs::control_answer::refused,
           &own_structs::control_answer::right>{};
template <>
inline constexpr auto schema<own_structs::control_row> =
    fields<&own_structs::control_row::topic, &own_structs::control_row::lease_ms,
           &own_structs::control_row::hold_ms, &own_structs::control_row::driver,
           &own_structs::control_row::number, &own_structs::control_row::since_ms,
           &own_structs::control_row::age_ms>{};
template <>
inline constexpr auto schema<own_structs::control_state> =
    fields<&own_structs::control_state::tick, &own_structs::control_state::topics>{}.type(
        "rowe/ControlState");

template <>
inline constexpr auto schema<own_structs::right_asked> =
    fields<&own_structs::right_asked::right, &own_structs::right_asked::name>{};
template <>
inline constexpr auto schema<own_structs::rights_request> = fields<&own_structs::rights_request::asked>{};
template <>
inline constexpr auto schema<own_structs::rights_answer> =
    fields<&own_structs::rights_answer::role, &own_structs::rights_answer::identity,
           &own_structs::rights_answer::allowed>{};

template <>
inline constexpr auto schema<own_structs::record_request> =
    fields<&own_structs::record_request::cause, &own_structs::record_request::write>{};
template <>
inline constexpr auto schema<own_structs::record_answer> = fields<&own_structs::record_answer::black_boxes>{};

template <>
inline constexpr auto schema<own_structs::parameter_values> =
    fields<&own_structs::parameter_values::values>{}.type("rowe/Parameters");
template <>
inline constexpr auto schema<own_structs::types_request> = fields<&own_structs::types_request::from>{};
template <>
inline constexpr auto schema<own_structs::type_row> =
    fields<&own_structs::type_row::topic, &own_structs::type_row::service, &own_structs::type_row::parameter,
           &own_structs::type_row::type, &own_structs::type_row::message, &own_structs::type_row::request,
           &own_structs::type_row::answer, &own_structs::type_row::value>{};
template <>
inline constexpr auto schema<own_structs::types_answer> =
    fields<&own_structs::types_answer::types, &own_structs::types_answer::next>{};

template <>
inline constexpr auto schema<own_structs::ros_version> =
    fields<&own_structs::ros_version::version, &own_structs::ros_version::distro>{};
template <>
inline constexpr auto schema<own_structs::services> =
    fields<&own_structs::services::services, &own_structs::services::left_out>{};
template <>
inline constexpr auto schema<own_structs::topics_and_types> =
    fields<&own_structs::topics_and_types::topics, &own_structs::topics_and_types::types,
           &own_structs::topics_and_types::left_out>{};
template <>
inline constexpr auto schema<own_structs::topics_and_raw_types> =
    fields<&own_structs::topics_and_raw_types::topics, &own_structs::topics_and_raw_types::types,
           &own_structs::topics_and_raw_types::typedefs_full_text>{};
template <>
inline constexpr auto schema<own_structs::node_details> =
    fields<&own_structs::node_details::subscribing, &own_structs::node_details::publishing,
           &own_structs::node_details::services>{};
template <>
inline constexpr auto schema<own_structs::time_now> =
    fields<&own_structs::time_now::secs, &own_structs::time_now::nsecs, &own_structs::time_now::sec,
           &own_structs::time_now::nanosec>{};
template <>
inline constexpr auto schema<own_structs::get_time> = fields<&own_structs::get_time::time>{};
template <>
inline constexpr auto schema<own_structs::type_definition> =
    fields<&own_structs::type_definition::type, &own_structs::type_definition::fieldnames,
           &own_structs::type_definition::fieldtypes, &own_structs::type_definition::fieldarraylen,
           &own_structs::type_definition::examples, &own_structs::type_definition::constnames,
           &own_structs::type_definition::constvalues>{}
        .type("rosapi/TypeDef");
template <>
inline constexpr auto schema<own_structs::type_definitions> =
    fields<&own_structs::type_definitions::typedefs>{};
template <>
inline constexpr auto schema<own_structs::get_param> =
    fields<&own_structs::get_param::name, field<&own_structs::get_param::default_value, "default">>{};
template <>
inline constexpr auto schema<own_structs::param> =
    fields<&own_structs::param::value, &own_structs::param::successful, &own_structs::param::reason>{};
template <>
inline constexpr auto schema<own_structs::set_param> =
    fields<&own_structs::set_param::name, &own_structs::set_param::value>{};
template <>
inline constexpr auto schema<own_structs::is_done> =
    fields<&own_structs::is_done::successful, &own_structs::is_done::reason>{};
template <>
inline constexpr auto schema<own_structs::exists> = fields<&own_structs::exists::exists>{};

} // namespace rowe
