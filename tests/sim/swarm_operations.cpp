// SPDX-License-Identifier: Apache-2.0
// The tables of the grammar: classes, operations, and their rows of the coverage table.
#include "swarm_grammar.hpp"

#include <algorithm>
#include <array>

namespace swarm {
namespace {

constexpr bool bad = false;

const std::vector<std::vector<value_class>>& all_classes() {
  static const std::vector<std::vector<value_class>> all = {
      /* topic */ {{"shared"},
                   {"own"},
                   {"honest"},
                   {"made_up"},
                   {"stats"},
                   {"stop_state"},
                   {"stop"},
                   {"reserved"},
                   {"escaped"},
                   {"no_slash"},
                   {"longest"},
                   {"too_long", bad},
                   {"empty", bad},
                   {"control", bad},
                   {"no_text", bad},
                   {"absent", bad}},
      /* service */
      {{"shared"},
       {"honest"},
       {"made_up"},
       {"stop"},
       {"reserved"},
       {"escaped"},
       {"no_slash"},
       {"longest"},
       {"too_long", bad},
       {"empty", bad},
       {"no_text", bad},
       {"absent", bad}},
      /* called_service */
      {{"shared"},
       {"honest"},
       {"nobodys"},
       {"stats"},
       {"list_topics"},
       {"list_services"},
       {"topic_type"},
       {"publishers"},
       {"service_type"},
       {"graph"},
       {"get_param_names"},
       {"get_param"},
       {"set_param"},
       {"has_param"},
       {"delete_param"},
       {"types"},
       {"message_details"},
       {"service_request_details"},
       {"service_response_details"},
       {"with_id"},
       {"escaped"},
       {"no_slash"},
       {"longest"},
       {"too_long", bad},
       {"empty", bad},
       {"no_text", bad},
       {"absent", bad}},
      /* stop_service */
      {{"plain"}, {"no_slash"}, {"escaped_slash"}, {"escaped_characters"}, {"with_id"}, {"with_long_id"}},
      /* id */
      {{"absent"},
       {"short"},
       {"number"},
       {"negative"},
       {"again"},
       {"escaped"},
       {"longest"},
       {"null"},
       {"empty"},
       {"too_long", bad},
       {"fraction", bad},
       {"object", bad}},
      /* answered_id */
      {{"asked"},
       {"answered"},
       {"of_others"},
       {"made_up"},
       {"longest"},
       {"too_long", bad},
       {"object", bad},
       {"absent", bad}},
      /* type */
      {{"absent"}, {"usual"}, {"other"}, {"empty"}, {"longest"}, {"too_long", bad}, {"no_text", bad}},
      /* period */
      {{"absent"},
       {"zero"},
       {"one"},
       {"short"},
       {"long"},
       {"hour"},
       {"largest"},
       {"too_large", bad},
       {"beyond_64_bits", bad},
       {"negative", bad},
       {"fraction", bad},
       {"no_number", bad}},
      /* count */
      {{"absent"},
       {"zero"},
       {"one"},
       {"some"},
       {"huge"},
       {"beyond_64_bits", bad},
       {"negative", bad},
       {"fraction", bad},
       {"no_number", bad}},
      /* fragment_size */
      {{"absent"},
       {"least"},
       {"few"},
       {"huge"},
       {"too_small", bad},
       {"zero", bad},
       {"negative", bad},
       {"fraction", bad},
       {"no_number", bad}},
      /* depth */
      {{"absent"},
       {"zero"},
       {"one"},
       {"few"},
       {"limit_less_one"},
       {"limit"},
       {"limit_and_one"},
       {"huge"},
       {"beyond_64_bits", bad},
       {"negative", bad},
       {"fraction", bad},
       {"no_number", bad}},
      /* boolean */ {{"absent"}, {"true"}, {"false"}, {"no_boolean", bad}},
      /* compression */
      {{"absent"}, {"none"}, {"png"}, {"cbor"}, {"cbor-raw"}, {"unknown", bad}, {"no_text", bad}},
      /* level */
      {{"none"}, {"error"}, {"warning"}, {"info"}, {"unknown", bad}, {"no_text", bad}, {"absent", bad}},
      /* history */ {{"absent"}, {"keep_last"}, {"keep_all"}, {"unknown", bad}, {"no_text", bad}},
      /* reliability */ {{"absent"}, {"reliable"}, {"best_effort"}, {"best_available"}, {"unknown", bad}},
      /* durability */ {{"absent"}, {"volatile"}, {"transient_local"}, {"best_available"}, {"unknown", bad}},
      /* time */
      {{"absent"},
       {"zero"},
       {"short"},
       {"secs_nsecs"},
       {"infinite"},
       {"huge"},
       {"negative", bad},
       {"no_time", bad}},
      /* body */
      {{"small"},
       {"empty"},
       {"small_slot_less_one"},
       {"small_slot"},
       {"small_slot_and_one"},
       {"large"},
       {"largest"},
       {"deep"},
       {"own_members"},
       {"array", bad},
       {"text", bad},
       {"too_deep", bad},
       {"absent", bad}},
      /* args */
      {{"small"},
       {"absent"},
       {"empty"},
       {"array"},
       {"large"},
       {"largest"},
       {"own_members"},
       {"names"},
       {"number", bad},
       {"text", bad}},
      /* values */
      {{"small"},
       {"absent"},
       {"text"},
       {"array"},
       {"number"},
       {"null"},
       {"large"},
       {"largest"},
       {"own_members"}},
      /* timeout */
      {{"absent"}, {"zero"}, {"short"}, {"long"}, {"huge"}, {"negative", bad}, {"no_number", bad}},
      /* ttl */
      {{"absent"},
       {"zero"},
       {"short"},
       {"fraction"},
       {"long"},
       {"huge"},
       {"negative", bad},
       {"no_number", bad}},
      /* text */ {{"short"}, {"empty"}, {"escaped"}, {"long"}, {"no_text", bad}, {"absent", bad}},
      /* source */
      {{"absent"}, {"one"}, {"one_of_many"}, {"longest"}, {"long_escaped"}, {"empty"}, {"number"}},
      /* guard */
      {{"one"},
       {"one_of_few"},
       {"one_of_many"},
       {"longest"},
       {"escaped"},
       {"too_long", bad},
       {"characters", bad},
       {"absent", bad}},
      /* number */
      {{"newest"},
       {"old"},
       {"next"},
       {"low_16_bits"},
       {"zero"},
       {"negative"},
       {"huge"},
       {"no_number"},
       {"absent"}},
      /* tick */
      {{"newest"}, {"old"}, {"before_last"}, {"future"}, {"zero"}, {"huge"}, {"no_number"}, {"absent"}},
      /* error */ {{"usual"}, {"no_service"}, {"long"}, {"no_code"}, {"no_object"}},
      /* unsupported */ {{"action_status"}, {"png"}, {"auth"}},
      /* unknown */ {{"word"}, {"escaped"}, {"longest"}, {"too_long", bad}, {"empty"}, {"control", bad}},
      /* payload */ {{"empty"}, {"short"}, {"longest"}},
      /* raw */
      {{"reserved_bits"},
       {"reserved_opcode"},
       {"long_control"},
       {"unmasked"},
       {"continuation"},
       {"huge_length"},
       {"random"}},
      /* list */ {{"one"}, {"two"}, {"many"}, {"twice"}, {"empty", bad}, {"no_list", bad}, {"flat", bad}},
      /* own_number */
      {{"few"}, {"used"}, {"largest"}, {"too_large", bad}, {"negative", bad}, {"no_number", bad}},
      /* channel */
      {{"listed"},
       {"shared"},
       {"own"},
       {"honest"},
       {"endpoints"},
       {"gone"},
       {"never"},
       {"largest"},
       {"too_large", bad},
       {"no_number", bad}},
      /* called_number */
      {{"listed"}, {"shared"}, {"honest"}, {"stats"}, {"lists"}, {"gone"}, {"never"}, {"zero"}, {"largest"}},
      /* call_number */ {{"few"}, {"again"}, {"zero"}, {"largest"}, {"quotes"}},
      /* number_frame */
      {{"empty", bad},
       {"unknown", bad},
       {"first_byte", bad},
       {"cut_publish", bad},
       {"cut_call", bad},
       {"servers", bad},
       {"no_json", bad},
       {"random", bad}},
      /* codec */ {{"none"}, {"numbers"}, {"unknown"}},
      /* path */ {{"root"}, {"stop"}},
      /* address */ {{"loopback"}, {"elsewhere"}},
      /* submitted */
      {{"small"},
       {"stop"},
       {"large"},
       {"largest"},
       {"array", bad},
       {"torn", bad},
       {"empty", bad},
       {"too_large", bad}},
      /* thread_service */
      {{"shared"},
       {"honest"},
       {"nobodys"},
       {"stats"},
       {"lists"},
       {"stop"},
       {"reset"},
       {"guard"},
       {"longest"},
       {"too_long", bad},
       {"no_text", bad},
       {"absent", bad}},
      /* wait */ {{"none"}, {"short"}, {"long"}, {"for_ever"}},
      /* addressee */ {{"everyone"}, {"peer"}, {"gone"}},
      /* outcome */ {{"waits"}, {"forgets"}},
      /* held_call */ {{"oldest"}, {"newest"}, {"answered"}},
      /* stop_words */ {{"with_it"}, {"behind_it"}},
      /* request_id */ {{"absent"}, {"short"}, {"longest"}, {"too_long", bad}, {"no_text", bad}},
      /* parameter_list */
      {{"known"},
       {"all"},
       {"endpoints"},
       {"nobodys"},
       {"odd"},
       {"many"},
       {"no_list", bad},
       {"no_text", bad},
       {"absent", bad}},
      /* parameter_value */
      {{"number"},
       {"text"},
       {"list"},
       {"too_large"},
       {"no_value"},
       {"endpoints"},
       {"nobodys"},
       {"odd"},
       {"no_object", bad},
       {"no_name", bad},
       {"bytes", bad},
       {"absent", bad}},
  };
  return all;
}

std::vector<operation> made_operations() {
  using d = dimension;
  const std::vector<member_rule> qos = {
      {"qos.history", domain::history},         {"qos.depth", domain::depth},
      {"qos.reliability", domain::reliability}, {"qos.durability", domain::durability},
      {"qos.deadline", domain::time},           {"qos.lifespan", domain::time}};
  const auto with = [](std::vector<member_rule> first, const std::vector<member_rule>& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
  };
  std::vector<operation> all = {
      {"subscribe",
       form::rosbridge,
       with({{"id", domain::id},
             {"topic", domain::topic},
             {"type", domain::type},
             {"throttle_rate", domain::period},
             {"queue_length", domain::depth},
             {"fragment_size", domain::fragment_size},
             {"compression", domain::compression}},
            qos),
       {d::topic, d::subscription, d::connection}},
      {"unsubscribe",
       form::rosbridge,
       {{"id", domain::id}, {"topic", domain::topic}},
       {d::topic, d::subscription, d::connection}},
      {"advertise",
       form::rosbridge,
       with({{"id", domain::id},
             {"topic", domain::topic},
             {"type", domain::type},
             {"latch", domain::boolean},
             {"queue_size", domain::count}},
            qos),
       {d::topic, d::connection}},
      {"unadvertise",
       form::rosbridge,
       {{"id", domain::id}, {"topic", domain::topic}},
       {d::topic, d::connection}},
      {"publish",
       form::rosbridge,
       {{"id", domain::id},
        {"topic", domain::topic},
        {"msg", domain::body},
        {"latch", domain::boolean},
        {"ttl_ms", domain::ttl}},
       {d::topic, d::connection}},
      {"call_service",
       form::rosbridge,
       {{"id", domain::id},
        {"service", domain::called_service},
        {"args", domain::args},
        {"timeout", domain::timeout},
        {"fragment_size", domain::fragment_size},
        {"compression", domain::compression}},
       {d::service, d::call, d::connection}},
      {"service_response",
       form::rosbridge,
       {{"id", domain::answered_id},
        {"service", domain::service},
        {"values", domain::values},
        {"result", domain::boolean}},
       {d::answer, d::connection}},
      {"advertise_service",
       form::rosbridge,
       {{"service", domain::service}, {"type", domain::type}},
       {d::service, d::connection}},
      {"unadvertise_service", form::rosbridge, {{"service", domain::service}}, {d::service, d::connection}},
      {"advertise_action",
       form::rosbridge,
       {{"action", domain::service}, {"type", domain::type}},
       {d::connection}},
      {"unadvertise_action", form::rosbridge, {{"action", domain::service}}, {d::connection}},
      {"send_action_goal",
       form::rosbridge,
       {{"id", domain::id},
        {"action", domain::service},
        {"action_type", domain::type},
        {"args", domain::args},
        {"feedback", domain::boolean},
        {"timeout", domain::timeout}},
       {d::connection}},
      {"cancel_action_goal",
       form::rosbridge,
       {{"id", domain::id}, {"action", domain::service}},
       {d::connection}},
      {"action_feedback",
       form::rosbridge,
       {{"id", domain::answered_id}, {"action", domain::service}, {"values", domain::values}},
       {d::connection}},
      {"action_result",
       form::rosbridge,
       {{"id", domain::answered_id},
        {"action", domain::service},
        {"values", domain::values},
        {"status", domain::count},
        {"result", domain::boolean}},
       {d::connection}},
      {"status",
       form::rosbridge,
       {{"level", domain::level}, {"msg", domain::text}, {"id", domain::id}},
       {d::connection}},
      {"set_level", form::rosbridge, {{"level", domain::level}, {"id", domain::id}}, {d::connection}},
      {"unsupported", form::rosbridge, {{"op", domain::unsupported}, {"id", domain::id}}, {d::connection}},
      {"unknown", form::rosbridge, {{"op", domain::unknown}, {"id", domain::id}}, {d::connection}},
      {"message", form::plain, {{"body", domain::body}, {"ttl_ms", domain::ttl}}, {d::connection}},
      {"invocation",
       form::plain,
       {{"message_id", domain::id},
        {"service", domain::called_service},
        {"body", domain::args},
        {"ttl_ms", domain::ttl}},
       {d::service, d::call, d::connection}},
      {"reply",
       form::plain,
       {{"in_reply_to", domain::answered_id}, {"body", domain::values}, {"ttl_ms", domain::ttl}},
       {d::answer, d::connection}},
      {"error",
       form::plain,
       {{"in_reply_to", domain::answered_id}, {"error", domain::error}},
       {d::answer, d::connection}},
      {"stop",
       form::stop_call,
       {{"service", domain::stop_service},
        {"id", domain::id},
        {"source", domain::source},
        {"reason", domain::source},
        {"timeout", domain::timeout}},
       {d::stop, d::connection}},
      {"stop_in_plain",
       form::stop_plain,
       {{"service", domain::stop_service},
        {"message_id", domain::id},
        {"source", domain::source},
        {"reason", domain::source},
        {"ttl_ms", domain::ttl}},
       {d::stop, d::connection}},
      {"stop_by_publish",
       form::stop_publish,
       {{"topic", domain::stop_service}, {"id", domain::id}, {"source", domain::source}},
       {d::stop, d::connection}},
      {"reset",
       form::stop_call,
       {{"service", domain::stop_service},
        {"id", domain::id},
        {"number", domain::number},
        {"tick", domain::tick}},
       {d::stop, d::connection}},
      {"reset_in_plain",
       form::stop_plain,
       {{"service", domain::stop_service},
        {"message_id", domain::id},
        {"number", domain::number},
        {"tick", domain::tick}},
       {d::stop, d::connection}},
      {"heartbeat",
       form::stop_call,
       {{"service", domain::stop_service},
        {"id", domain::id},
        {"guard", domain::guard},
        {"tick", domain::tick},
        {"resign", domain::boolean}},
       {d::stop, d::connection}},
      {"heartbeat_in_plain",
       form::stop_plain,
       {{"service", domain::stop_service},
        {"message_id", domain::id},
        {"guard", domain::guard},
        {"tick", domain::tick},
        {"resign", domain::boolean}},
       {d::stop, d::connection}},
      {"stop_state",
       form::stop_call,
       {{"service", domain::stop_service}, {"id", domain::id}},
       {d::stop, d::connection}},
      {"malformed", form::malformed, {{"text", domain::text}}, {d::connection}},
      {"binary", form::binary, {{"payload", domain::payload}}, {d::connection}},
      {"ping", form::control, {{"payload", domain::payload}}, {d::connection}},
      {"pong", form::control, {{"payload", domain::payload}}, {d::connection}},
      {"close", form::close, {{"payload", domain::payload}}, {d::connection}},
      {"fragments", form::fragments, {{"body", domain::body}}, {d::connection}},
      {"partial", form::partial, {{"body", domain::body}}, {d::connection}},
      {"no_frame", form::no_frame, {{"raw", domain::raw}}, {d::connection}},
      {"want",
       form::number_text,
       {{"list", domain::list}, {"tag", domain::own_number}, {"topic", domain::channel}},
       {d::topic, d::subscription, d::connection}},
      {"drop",
       form::number_text,
       {{"list", domain::list}, {"tag", domain::own_number}},
       {d::subscription, d::connection}},
      {"offer",
       form::number_text,
       {{"list", domain::list}, {"channel", domain::own_number}, {"topic", domain::topic}},
       {d::topic, d::connection}},
      {"keep",
       form::number_text,
       {{"list", domain::list}, {"channel", domain::own_number}},
       {d::topic, d::connection}},
      {"publish_by_number",
       form::number_binary,
       {{"channel", domain::own_number}, {"msg", domain::body}},
       {d::topic, d::connection}},
      {"call_by_number",
       form::number_binary,
       {{"service", domain::called_number}, {"id", domain::call_number}, {"args", domain::args}},
       {d::service, d::call, d::connection}},
      {"message_in_numbers", form::number_binary, {{"msg", domain::body}}, {d::connection}},
      {"stop_by_number",
       form::number_stop,
       {{"id", domain::call_number}, {"source", domain::source}, {"reason", domain::source}},
       {d::stop, d::connection}},
      {"reset_by_number",
       form::number_stop,
       {{"id", domain::call_number}, {"number", domain::number}, {"tick", domain::tick}},
       {d::stop, d::connection}},
      {"heartbeat_by_number",
       form::number_stop,
       {{"id", domain::call_number},
        {"guard", domain::guard},
        {"tick", domain::tick},
        {"resign", domain::boolean}},
       {d::stop, d::connection}},
      {"no_number_frame", form::number_binary, {{"frame", domain::number_frame}}, {d::connection}},
      {"open",
       form::opening,
       {{"codec", domain::codec}, {"path", domain::path}, {"address", domain::address}},
       {}},
      {"thread_message",
       form::submission,
       {{"text", domain::submitted},
        {"ttl", domain::wait},
        {"to", domain::addressee},
        {"outcome", domain::outcome}},
       {d::queue}},
      {"thread_call",
       form::submission,
       {{"service", domain::thread_service},
        {"args", domain::args},
        {"timeout", domain::wait},
        {"to", domain::addressee}},
       {d::queue}},
      {"thread_receive", form::submission, {}, {d::inbox}},
      {"thread_reply",
       form::submission,
       {{"call", domain::held_call}, {"values", domain::submitted}, {"outcome", domain::outcome}},
       {d::queue}},
      {"thread_refusal",
       form::submission,
       {{"call", domain::held_call}, {"why", domain::source}, {"outcome", domain::outcome}},
       {d::queue}},
      {"thread_wait", form::submission, {}, {d::outcome}},
      {"thread_stop",
       form::thread_stop,
       {{"words", domain::stop_words}, {"source", domain::source}, {"reason", domain::source}},
       {d::stop}},
      {"thread_reset", form::thread_stop, {{"number", domain::number}, {"timeout", domain::wait}}, {d::stop}},
      {"thread_hear", form::thread_stop, {}, {d::heard}},
      {"get_parameters",
       form::foxglove_text,
       {{"id", domain::request_id}, {"parameterNames", domain::parameter_list}},
       {d::connection}},
      {"set_parameters",
       form::foxglove_text,
       {{"id", domain::request_id}, {"parameters", domain::parameter_value}},
       {d::connection}},
      {"watch_parameters",
       form::foxglove_text,
       {{"parameterNames", domain::parameter_list}},
       {d::connection}},
      {"unwatch_parameters",
       form::foxglove_text,
       {{"parameterNames", domain::parameter_list}},
       {d::connection}},
      {"watch_graph", form::foxglove_text, {}, {d::connection}},
      {"unwatch_graph", form::foxglove_text, {}, {d::connection}},
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
