// SPDX-License-Identifier: Apache-2.0
// The tables of the grammar: classes, operations, and their rows of the coverage table.
#include "swarm_grammar.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>

namespace swarm {
namespace {

// With a "!" before the name: of values that are refused.
std::vector<value_class> classes(std::initializer_list<std::string_view> names) {
  std::vector<value_class> all;
  for (const std::string_view name : names) {
    const bool good = name.front() != '!';
    all.push_back({name.substr(good ? 0 : 1), good});
  }
  return all;
}

const std::vector<std::vector<value_class>>& all_classes() {
  static const std::vector<std::vector<value_class>> all = {
      /* topic */ classes({"shared", "own", "honest", "made_up", "stats", "stop_state", "stop", "reserved",
                           "escaped", "no_slash", "longest", "!too_long", "!empty", "!control", "!no_text",
                           "!absent"}),
      /* service */
      classes({"shared", "honest", "made_up", "stop", "reserved", "escaped", "no_slash", "longest",
               "!too_long", "!empty", "!no_text", "!absent"}),
      /* called_service */
      classes({"shared",
               "honest",
               "nobodys",
               "stats",
               "list_topics",
               "list_services",
               "topic_type",
               "publishers",
               "service_type",
               "graph",
               "get_param_names",
               "get_param",
               "set_param",
               "has_param",
               "delete_param",
               "types",
               "record",
               "message_details",
               "service_request_details",
               "service_response_details",
               "with_id",
               "escaped",
               "no_slash",
               "longest",
               "!too_long",
               "!empty",
               "!no_text",
               "!absent"}),
      /* stop_service */
      classes({"plain", "no_slash", "escaped_slash", "escaped_characters", "with_id", "with_long_id"}),
      /* id */
      classes({"absent", "short", "number", "negative", "again", "escaped", "longest", "null", "empty",
               "!too_long", "!fraction", "!object"}),
      /* answered_id */
      classes({"asked", "answered", "of_others", "made_up", "longest", "!too_long", "!object", "!absent"}),
      /* type */ classes({"absent", "usual", "other", "empty", "longest", "!too_long", "!no_text"}),
      /* period */
      classes({"absent", "zero", "one", "short", "long", "hour", "largest", "!too_large", "!beyond_64_bits",
               "!negative", "!fraction", "!no_number"}),
      /* count */
      classes({"absent", "zero", "one", "some", "huge", "!beyond_64_bits", "!negative", "!fraction",
               "!no_number"}),
      /* fragment_size */
      classes(
          {"absent", "least", "few", "huge", "!too_small", "!zero", "!negative", "!fraction", "!no_number"}),
      /* depth */
      classes({"absent", "zero", "one", "few", "limit_less_one", "limit", "limit_and_one", "huge",
               "!beyond_64_bits", "!negative", "!fraction", "!no_number"}),
      /* boolean */ classes({"absent", "true", "false", "!no_boolean"}),
      /* compression */ classes({"absent", "none", "png", "cbor", "cbor-raw", "!unknown", "!no_text"}),
      /* level */ classes({"none", "error", "warning", "info", "!unknown", "!no_text", "!absent"}),
      /* history */ classes({"absent", "keep_last", "keep_all", "!unknown", "!no_text"}),
      /* reliability */ classes({"absent", "reliable", "best_effort", "best_available", "!unknown"}),
      /* durability */ classes({"absent", "volatile", "transient_local", "best_available", "!unknown"}),
      /* time */
      classes({"absent", "zero", "short", "secs_nsecs", "infinite", "huge", "!negative", "!no_time"}),
      /* body */
      classes({"small", "empty", "small_slot_less_one", "small_slot", "small_slot_and_one", "large",
               "largest", "deep", "own_members", "!array", "!text", "!too_deep", "!absent"}),
      /* args */
      classes({"small", "absent", "empty", "array", "large", "largest", "own_members", "names", "!number",
               "!text"}),
      /* values */
      classes({"small", "absent", "text", "array", "number", "null", "large", "largest", "own_members"}),
      /* timeout */ classes({"absent", "zero", "short", "long", "huge", "!negative", "!no_number"}),
      /* ttl */ classes({"absent", "zero", "short", "fraction", "long", "huge", "!negative", "!no_number"}),
      /* text */ classes({"short", "empty", "escaped", "long", "!no_text", "!absent"}),
      /* source */ classes({"absent", "one", "one_of_many", "longest", "long_escaped", "empty", "number"}),
      /* guard */
      classes(
          {"one", "one_of_few", "one_of_many", "longest", "escaped", "!too_long", "!characters", "!absent"}),
      /* number */
      classes({"newest", "old", "next", "low_16_bits", "zero", "negative", "huge", "no_number", "absent"}),
      /* tick */ classes({"newest", "old", "before_last", "future", "zero", "huge", "no_number", "absent"}),
      /* error */ classes({"usual", "no_service", "long", "no_code", "no_object"}),
      /* unsupported */ classes({"action_status", "png", "auth"}),
      /* unknown */ classes({"word", "escaped", "longest", "!too_long", "empty", "!control"}),
      /* payload */ classes({"empty", "short", "longest"}),
      /* raw */
      classes({"reserved_bits", "reserved_opcode", "long_control", "unmasked", "continuation", "huge_length",
               "random"}),
      /* list */ classes({"one", "two", "many", "twice", "!empty", "!no_list", "!flat"}),
      /* own_number */ classes({"few", "used", "largest", "!too_large", "!negative", "!no_number"}),
      /* channel */
      classes({"listed", "shared", "own", "honest", "endpoints", "gone", "never", "largest", "!too_large",
               "!no_number"}),
      /* called_number */
      classes({"listed", "shared", "honest", "stats", "lists", "gone", "never", "zero", "largest"}),
      /* call_number */ classes({"few", "again", "zero", "largest", "quotes"}),
      /* number_frame */
      classes({"!empty", "!unknown", "!first_byte", "!cut_publish", "!cut_call", "!servers", "!no_json",
               "!random"}),
      /* codec */ classes({"none", "numbers", "unknown"}),
      /* path */ classes({"root", "stop"}),
      /* address */ classes({"loopback", "elsewhere"}),
      /* submitted */
      classes({"small", "stop", "large", "largest", "!array", "!torn", "!empty", "!too_large"}),
      /* thread_service */
      classes({"shared", "honest", "nobodys", "stats", "lists", "stop", "reset", "guard", "longest",
               "!too_long", "!no_text", "!absent"}),
      /* wait */ classes({"none", "short", "long", "for_ever"}),
      /* addressee */ classes({"everyone", "peer", "gone"}),
      /* outcome */ classes({"waits", "forgets"}),
      /* held_call */ classes({"oldest", "newest", "answered"}),
      /* stop_words */ classes({"with_it", "behind_it"}),
      /* request_id */ classes({"absent", "short", "longest", "!too_long", "!no_text"}),
      /* parameter_list */
      classes({"known", "all", "endpoints", "nobodys", "odd", "many", "!no_list", "!no_text", "!absent"}),
      /* parameter_value */
      classes({"number", "text", "list", "too_large", "no_value", "endpoints", "nobodys", "odd", "!no_object",
               "!no_name", "!bytes", "!absent"}),
      /* driven_topic */ classes({"driven", "no_slash", "other"}),
      /* command_body */
      classes({"right", "more", "null", "text", "missing", "fraction", "large", "!infinite", "!array",
               "!absent"}),
      /* command_tick */
      classes({"newest", "absent", "before_last", "old", "future", "zero", "huge", "!beyond_64_bits",
               "!negative", "!fraction", "!no_number", "!null"}),
      /* control_service */ classes({"plain", "no_slash", "escaped", "with_id"}),
      /* control_state */ classes({"plain", "no_slash", "escaped"}),
      /* control_topic */ classes({"absent", "driven", "no_slash", "other", "empty", "long", "no_text"}),
      /* control_action */
      classes({"take", "absent", "take_over", "release", "unknown", "empty", "long", "no_text"}),
      /* driver_name */
      classes({"absent", "short", "of_this_process", "escaped", "longest", "long", "empty", "no_text"}),
      /* control_tick */
      classes({"newest", "absent", "before_last", "old", "future", "zero", "huge", "beyond_64_bits",
               "negative", "fraction", "no_number", "null"}),
      /* rights_service */ classes({"plain", "no_slash", "escaped", "with_id"}),
      /* rights_args */
      classes({"one", "every", "few", "most", "too_many", "empty", "no_list", "object", "text", "null", "odd",
               "twice", "escaped", "nothing", "other", "no_args", "array", "!number", "!no_object"}),
      /* rights_asked */
      classes({"one", "every", "few", "most", "too_many", "empty", "no_list", "object", "text", "null", "odd",
               "absent"}),
      /* right */
      classes({"each", "of_stop", "unknown", "upper_case", "blank", "escaped", "long", "long_escaped",
               "empty", "no_text", "twice", "absent"}),
      /* right_of */
      classes({"arm", "topic", "service", "endpoints", "flat", "no_slash", "escaped", "pattern", "long",
               "long_escaped", "empty", "no_text", "twice", "absent"}),
  };
  return all;
}

std::vector<operation> made_operations() {
  using d = dimension;
  using enum domain;
  const std::vector<member_rule> qos = {{"qos.history", history},         {"qos.depth", depth},
                                        {"qos.reliability", reliability}, {"qos.durability", durability},
                                        {"qos.deadline", time},           {"qos.lifespan", time}};
  const auto with = [](std::vector<member_rule> first, const std::vector<member_rule>& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
  };
  std::vector<operation> all = {
      {"subscribe",
       form::rosbridge,
       with({{"id", id},
             {"topic", topic},
             {"type", type},
             {"throttle_rate", period},
             {"queue_length", depth},
             {"fragment_size", fragment_size},
             {"compression", compression}},
            qos),
       {d::topic, d::subscription, d::connection}},
      {"unsubscribe",
       form::rosbridge,
       {{"id", id}, {"topic", topic}},
       {d::topic, d::subscription, d::connection}},
      {"advertise",
       form::rosbridge,
       with({{"id", id}, {"topic", topic}, {"type", type}, {"latch", boolean}, {"queue_size", count}}, qos),
       {d::topic, d::connection}},
      {"unadvertise", form::rosbridge, {{"id", id}, {"topic", topic}}, {d::topic, d::connection}},
      {"publish",
       form::rosbridge,
       {{"id", id}, {"topic", topic}, {"msg", body}, {"latch", boolean}, {"ttl_ms", ttl}},
       {d::topic, d::connection}},
      {"call_service",
       form::rosbridge,
       {{"id", id},
        {"service", called_service},
        {"args", args},
        {"timeout", timeout},
        {"fragment_size", fragment_size},
        {"compression", compression}},
       {d::service, d::call, d::connection}},
      {"service_response",
       form::rosbridge,
       {{"id", answered_id}, {"service", service}, {"values", values}, {"result", boolean}},
       {d::answer, d::connection}},
      {"advertise_service",
       form::rosbridge,
       {{"service", service}, {"type", type}},
       {d::service, d::connection}},
      {"unadvertise_service", form::rosbridge, {{"service", service}}, {d::service, d::connection}},
      {"advertise_action", form::rosbridge, {{"action", service}, {"type", type}}, {d::connection}},
      {"unadvertise_action", form::rosbridge, {{"action", service}}, {d::connection}},
      {"send_action_goal",
       form::rosbridge,
       {{"id", id},
        {"action", service},
        {"action_type", type},
        {"args", args},
        {"feedback", boolean},
        {"timeout", timeout}},
       {d::connection}},
      {"cancel_action_goal", form::rosbridge, {{"id", id}, {"action", service}}, {d::connection}},
      {"action_feedback",
       form::rosbridge,
       {{"id", answered_id}, {"action", service}, {"values", values}},
       {d::connection}},
      {"action_result",
       form::rosbridge,
       {{"id", answered_id}, {"action", service}, {"values", values}, {"status", count}, {"result", boolean}},
       {d::connection}},
      {"status", form::rosbridge, {{"level", level}, {"msg", text}, {"id", id}}, {d::connection}},
      {"set_level", form::rosbridge, {{"level", level}, {"id", id}}, {d::connection}},
      {"unsupported", form::rosbridge, {{"op", unsupported}, {"id", id}}, {d::connection}},
      {"unknown", form::rosbridge, {{"op", unknown}, {"id", id}}, {d::connection}},
      {"message", form::plain, {{"body", body}, {"ttl_ms", ttl}}, {d::connection}},
      {"invocation",
       form::plain,
       {{"message_id", id}, {"service", called_service}, {"body", args}, {"ttl_ms", ttl}},
       {d::service, d::call, d::connection}},
      {"reply",
       form::plain,
       {{"in_reply_to", answered_id}, {"body", values}, {"ttl_ms", ttl}},
       {d::answer, d::connection}},
      {"error", form::plain, {{"in_reply_to", answered_id}, {"error", error}}, {d::answer, d::connection}},
      {"stop",
       form::stop_call,
       {{"service", stop_service}, {"id", id}, {"source", source}, {"reason", source}, {"timeout", timeout}},
       {d::stop, d::connection}},
      {"stop_in_plain",
       form::stop_plain,
       {{"service", stop_service},
        {"message_id", id},
        {"source", source},
        {"reason", source},
        {"ttl_ms", ttl}},
       {d::stop, d::connection}},
      {"stop_by_publish",
       form::stop_publish,
       {{"topic", stop_service}, {"id", id}, {"source", source}},
       {d::stop, d::connection}},
      {"reset",
       form::stop_call,
       {{"service", stop_service}, {"id", id}, {"number", number}, {"tick", tick}},
       {d::stop, d::connection}},
      {"reset_in_plain",
       form::stop_plain,
       {{"service", stop_service}, {"message_id", id}, {"number", number}, {"tick", tick}},
       {d::stop, d::connection}},
      {"heartbeat",
       form::stop_call,
       {{"service", stop_service}, {"id", id}, {"guard", guard}, {"tick", tick}, {"resign", boolean}},
       {d::stop, d::connection}},
      {"heartbeat_in_plain",
       form::stop_plain,
       {{"service", stop_service}, {"message_id", id}, {"guard", guard}, {"tick", tick}, {"resign", boolean}},
       {d::stop, d::connection}},
      {"stop_state", form::stop_call, {{"service", stop_service}, {"id", id}}, {d::stop, d::connection}},
      {"malformed", form::malformed, {{"text", text}}, {d::connection}},
      {"binary", form::binary, {{"payload", payload}}, {d::connection}},
      {"ping", form::control, {{"payload", payload}}, {d::connection}},
      {"pong", form::control, {{"payload", payload}}, {d::connection}},
      {"close", form::close, {{"payload", payload}}, {d::connection}},
      {"fragments", form::fragments, {{"body", body}}, {d::connection}},
      {"partial", form::partial, {{"body", body}}, {d::connection}},
      {"no_frame", form::no_frame, {{"raw", raw}}, {d::connection}},
      {"want",
       form::number_text,
       {{"list", list}, {"tag", own_number}, {"topic", channel}},
       {d::topic, d::subscription, d::connection}},
      {"drop", form::number_text, {{"list", list}, {"tag", own_number}}, {d::subscription, d::connection}},
      {"offer",
       form::number_text,
       {{"list", list}, {"channel", own_number}, {"topic", topic}},
       {d::topic, d::connection}},
      {"keep", form::number_text, {{"list", list}, {"channel", own_number}}, {d::topic, d::connection}},
      {"publish_by_number",
       form::number_binary,
       {{"channel", own_number}, {"msg", body}},
       {d::topic, d::connection}},
      {"call_by_number",
       form::number_binary,
       {{"service", called_number}, {"id", call_number}, {"args", args}},
       {d::service, d::call, d::connection}},
      {"message_in_numbers", form::number_binary, {{"msg", body}}, {d::connection}},
      {"stop_by_number",
       form::number_stop,
       {{"id", call_number}, {"source", source}, {"reason", source}},
       {d::stop, d::connection}},
      {"reset_by_number",
       form::number_stop,
       {{"id", call_number}, {"number", number}, {"tick", tick}},
       {d::stop, d::connection}},
      {"heartbeat_by_number",
       form::number_stop,
       {{"id", call_number}, {"guard", guard}, {"tick", tick}, {"resign", boolean}},
       {d::stop, d::connection}},
      {"no_number_frame", form::number_binary, {{"frame", number_frame}}, {d::connection}},
      {"open", form::opening, {{"codec", codec}, {"path", path}, {"address", address}}, {}},
      {"thread_message",
       form::submission,
       {{"text", submitted}, {"ttl", wait}, {"to", addressee}, {"outcome", outcome}},
       {d::queue}},
      {"thread_call",
       form::submission,
       {{"service", thread_service}, {"args", args}, {"timeout", wait}, {"to", addressee}},
       {d::queue}},
      {"thread_receive", form::submission, {}, {d::inbox}},
      {"thread_reply",
       form::submission,
       {{"call", held_call}, {"values", submitted}, {"outcome", outcome}},
       {d::queue}},
      {"thread_refusal",
       form::submission,
       {{"call", held_call}, {"why", source}, {"outcome", outcome}},
       {d::queue}},
      {"thread_wait", form::submission, {}, {d::outcome}},
      {"thread_stop",
       form::thread_stop,
       {{"words", stop_words}, {"source", source}, {"reason", source}},
       {d::stop}},
      {"thread_reset", form::thread_stop, {{"number", number}, {"timeout", wait}}, {d::stop}},
      {"thread_hear", form::thread_stop, {}, {d::heard}},
      {"get_parameters",
       form::foxglove_text,
       {{"id", request_id}, {"parameterNames", parameter_list}},
       {d::connection}},
      {"set_parameters",
       form::foxglove_text,
       {{"id", request_id}, {"parameters", parameter_value}},
       {d::connection}},
      {"watch_parameters", form::foxglove_text, {{"parameterNames", parameter_list}}, {d::connection}},
      {"unwatch_parameters", form::foxglove_text, {{"parameterNames", parameter_list}}, {d::connection}},
      {"watch_graph", form::foxglove_text, {}, {d::connection}},
      {"unwatch_graph", form::foxglove_text, {}, {d::connection}},
      {"command",
       form::rosbridge,
       {{"id", id}, {"topic", driven_topic}, {"msg", command_body}, {"tick", command_tick}, {"ttl_ms", ttl}},
       {d::stop, d::connection},
       "publish"},
      {"control",
       form::rosbridge,
       {{"id", id},
        {"service", control_service},
        {"args.topic", control_topic},
        {"args.action", control_action},
        {"args.name", driver_name},
        {"args.tick", control_tick}},
       {d::stop, d::connection},
       "call_service"},
      {"control_in_plain",
       form::plain,
       {{"message_id", id},
        {"service", control_service},
        {"topic", control_topic},
        {"action", control_action},
        {"name", driver_name},
        {"tick", control_tick}},
       {d::stop, d::connection}},
      {"watch_control",
       form::rosbridge,
       {{"id", id}, {"topic", control_state}, {"throttle_rate", period}, {"queue_length", depth}},
       {d::connection},
       "subscribe"},
      {"rights",
       form::rosbridge,
       {{"id", id}, {"service", rights_service}, {"args", rights_args}, {"right", right}, {"of", right_of}},
       {d::connection},
       "call_service"},
      {"rights_in_plain",
       form::plain,
       {{"message_id", id},
        {"service", rights_service},
        {"asked", rights_asked},
        {"right", right},
        {"of", right_of}},
       {d::connection}},
  };
  for (operation& one : all) {
    if (speaker_of(one.goes) != speaker::thread) one.of.push_back(d::times);
  }
  return all;
}

struct row_table {
  std::vector<row_name> rows;
  std::vector<std::size_t> first_of;                     // each operation's own
  std::vector<std::vector<std::size_t>> first_of_member; // where the classes of each member begin

  row_table() {
    const auto& all = operations();
    for (std::size_t o = 0; o < all.size(); ++o) {
      first_of.push_back(rows.size());
      rows.push_back({.operation = o, .own = true});
      first_of_member.emplace_back();
      for (std::size_t m = 0; m < all[o].members.size(); ++m) {
        first_of_member.back().push_back(rows.size());
        for (std::size_t v = 0; v < classes_of(all[o].members[m].is).size(); ++v)
          rows.push_back({.operation = o, .member = m, .value = v, .own = false});
      }
    }
  }
};

const row_table& table() {
  static const row_table one;
  return one;
}

} // namespace

const std::vector<value_class>& classes_of(domain what) {
  return all_classes()[static_cast<std::size_t>(what)];
}

speaker speaker_of(form goes) {
  switch (goes) {
  case form::rosbridge:
  case form::plain:
  case form::stop_call:
  case form::stop_plain:
  case form::stop_publish: return speaker::peer;
  case form::number_text:
  case form::number_binary:
  case form::number_stop: return speaker::numbers_peer;
  case form::foxglove_text: return speaker::foxglove_peer;
  case form::submission:
  case form::thread_stop: return speaker::thread;
  case form::malformed:
  case form::binary:
  case form::control:
  case form::close:
  case form::fragments:
  case form::partial:
  case form::no_frame:
  case form::opening: break;
  }
  return speaker::any_peer;
}

bool is_message(form goes) {
  return speaker_of(goes) != speaker::any_peer && speaker_of(goes) != speaker::thread;
}

std::string_view name_of(dimension what) {
  constexpr std::array<std::string_view, dimensions> names{"topic",  "subscription", "service",    "call",
                                                           "answer", "stop",         "connection", "times",
                                                           "queue",  "inbox",        "outcome",    "heard"};
  return names[static_cast<std::size_t>(what)];
}

const std::vector<operation>& operations() {
  static const std::vector<operation> all = made_operations();
  return all;
}

std::size_t operation_named(std::string_view name) {
  const auto& all = operations();
  const auto found = std::find_if(all.begin(), all.end(), [&](const operation& o) { return o.name == name; });
  return static_cast<std::size_t>(found - all.begin());
}

const std::vector<row_name>& rows() { return table().rows; }
std::size_t row_of(std::size_t operation) { return table().first_of[operation]; }
std::size_t row_of(std::size_t operation, std::size_t member, std::size_t value) {
  return table().first_of_member[operation][member] + value;
}

std::string text_of(const row_name& row) {
  const operation& of = operations()[row.operation];
  std::string text{of.name};
  if (row.own) return text;
  text += '.';
  text += of.members[row.member].name;
  text += '=';
  text += classes_of(of.members[row.member].is)[row.value].name;
  return text;
}

} // namespace swarm
