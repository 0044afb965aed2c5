// SPDX-License-Identifier: Apache-2.0
// What the endpoint's own topics and services say, as structs. Nobody makes objects of them: they are there
// to be described (own_type_schemas.hpp). For own_types.cpp only.
#pragma once
#include <cstdint>
#include <optional>

#include <rowe/bounded_array.hpp>
#include <rowe/fixed_string.hpp>
#include <rowe/limits.hpp>
#include <rowe/schema.hpp>

#include "service/base/counters.hpp"
#include "service/base/limit_table.hpp"

namespace rowe::service::own_structs {

using name_text = fixed_string<256>;
using reason_text = fixed_string<1024>;
template <class T>
using list = bounded_array<T, many>;
template <class T>
using null_while_none = std::optional<std::optional<T>>;

struct anything {};

// One member, of this name.
template <detail::name_literal Name>
struct one_text {
  name_text text;
};
template <detail::name_literal Name>
struct one_list {
  list<name_text> texts;
};

struct counts {
#define ROWE_MEMBER(name, group, meaning) std::uint64_t name = 0;
  ROWE_COUNTERS(ROWE_MEMBER)
#undef ROWE_MEMBER
};
struct losses : counts {};
struct bounds : limits {};

// ---- /rowe/stats

struct granted {
  bool fifo = false, pinned = false, locked = false;
};
struct topic_row {
  name_text topic, type;
  std::uint64_t messages = 0;
  double rate_hz = 0;
  std::uint64_t bytes = 0;
  double gap_ms_max = 0;
  std::uint32_t subscribers = 0;
};
struct timing_row {
  name_text name;
  std::uint64_t cycles = 0;
  double p50_us = 0, p99_us = 0, p999_us = 0, max_us = 0, bound_us = 0;
};
struct stats {
  name_text name;
  fixed_string<16> epoch;
  double uptime_s = 0;
  std::uint32_t peers = 0;
  granted real_time;
  double rates_over_s = 0;
  list<topic_row> topics;
  std::uint32_t topics_left_out = 0;
  own_structs::losses losses;
  double cycle_us_max = 0;
  list<timing_row> loops;
};
struct connection_row {
  name_text address;
  std::optional<name_text> identity, identity_role;
  name_text role, format;
  bool takes_messages = false;
  double since_s = 0, silent_s = 0;
  std::uint64_t messages_in = 0, messages_out = 0, queued = 0;
  bool blocked = false;
  std::uint32_t subscriptions = 0, calls = 0;
};
struct all_stats : stats {
  list<connection_row> connections;
  std::uint32_t connections_left_out = 0;
  counts counters;
  own_structs::bounds limits;
};

// ---- the stop

enum class motion : std::uint8_t { running, stopped };
enum class cause : std::uint8_t { start, request, guard, loop, service };

struct stop_request {
  std::optional<name_text> source, reason;
};
struct stop_answer {
  motion state{};
  std::uint64_t number = 0;
  null_while_none<own_structs::cause> cause;
  null_while_none<name_text> source;
  std::int64_t accepted_ns = 0;
  null_while_none<std::int64_t> observed_ns;
};
struct reset_request {
  std::uint64_t number = 0, tick = 0;
};
struct reset_answer {
  motion state{};
  std::uint64_t number = 0;
  null_while_none<name_text> refused;
  std::optional<name_text> right;
};
struct heartbeat {
  name_text guard;
  std::uint64_t tick = 0;
  std::optional<bool> resign;
};
struct heartbeat_answer {
  motion state{};
  std::uint64_t number = 0;
  std::int64_t timeout_ms = 0;
  std::uint64_t tick = 0;
  null_while_none<name_text> refused;
  std::optional<name_text> right;
};
struct guard_row {
  name_text name;
  double age_ms = 0;
  bool fresh = false;
};
struct loop_row {
  name_text name;
  double age_ms = 0;
  std::uint64_t acknowledged = 0;
};
struct stop_state {
  motion state{};
  std::uint64_t number = 0;
  null_while_none<own_structs::cause> cause;
  null_while_none<name_text> source;
  double since_ms = 0;
  std::uint64_t tick = 0;
  bool unguarded = false;
  list<guard_row> guards;
  list<loop_row> loops;
};

// ---- control

struct control_request {
  std::optional<name_text> topic, action, name;
  std::optional<std::uint64_t> tick;
};
struct control_answer {
  std::optional<name_text> topic;
  null_while_none<name_text> driver;
  std::optional<std::uint64_t> number;
  std::optional<bool> yours;
  std::optional<std::int64_t> lease_ms, hold_ms;
  std::uint64_t tick = 0;
  null_while_none<name_text> refused;
  std::optional<name_text> right;
};
struct control_row {
  name_text topic;
  std::int64_t lease_ms = 0, hold_ms = 0;
  null_while_none<name_text> driver;
  std::uint64_t number = 0;
  std::int64_t since_ms = 0;
  null_while_none<std::int64_t> age_ms;
};
struct control_state {
  std::uint64_t tick = 0;
  list<control_row> topics;
};

// ---- rights

struct right_asked {
  name_text right;
  std::optional<name_text> name;
};
struct rights_request {
  list<right_asked> asked;
};
struct rights_answer {
  null_while_none<name_text> role, identity;
  list<bool> allowed;
};

// ---- recordings

struct record_request {
  std::optional<name_text> cause;
  std::optional<bool> write; // false: they are counted only
};
struct record_answer {
  std::uint32_t black_boxes = 0; // that write what they retain
};

// ---- types and parameters

struct parameter_values {
  anything values;
};
struct types_request {
  std::optional<std::uint64_t> from;
};
struct type_row {
  std::optional<name_text> topic, service, parameter;
  name_text type;
  std::optional<anything> message, request, answer, value;
};
struct types_answer {
  list<type_row> types;
  null_while_none<std::uint64_t> next;
};

// ---- those of ROS

using of_topic = one_text<"topic">;
using of_type = one_text<"type">;
using of_service = one_text<"service">;
using of_node = one_text<"node">;
using of_host = one_text<"host">;
using of_action = one_text<"action">;
using interfaces = one_list<"interfaces">;
struct ros_version {
  std::uint8_t version = 0;
  name_text distro;
};
using of_name = one_text<"name">;
using topics = one_list<"topics">;
struct services {
  list<name_text> services;
  std::optional<std::uint32_t> left_out;
};
using nodes = one_list<"nodes">;
using names_list = one_list<"names">;
struct topics_and_types {
  list<name_text> topics, types;
  std::optional<std::uint32_t> left_out;
};
struct topics_and_raw_types {
  list<name_text> topics, types, typedefs_full_text;
};
struct node_details {
  list<name_text> subscribing, publishing, services;
};
using publishers = one_list<"publishers">;
using subscribers = one_list<"subscribers">;
using providers = one_list<"providers">;
using action_servers = one_list<"action_servers">;
struct time_now {
  std::int64_t secs = 0, nsecs = 0, sec = 0, nanosec = 0;
};
struct get_time {
  time_now time;
};
struct type_definition {
  name_text type;
  list<name_text> fieldnames, fieldtypes;
  list<std::int64_t> fieldarraylen;
  list<name_text> examples, constnames, constvalues;
};
struct type_definitions {
  list<type_definition> typedefs;
};
struct get_param {
  name_text name;
  std::optional<reason_text> default_value;
};
struct param {
  reason_text value;
  bool successful = false;
  reason_text reason;
};
struct set_param {
  name_text name;
  reason_text value;
};
struct is_done {
  bool successful = false;
  reason_text reason;
};
struct exists {
  bool exists = false;
};
using found_name = one_text<"global_name">;

} // namespace rowe::service::own_structs
