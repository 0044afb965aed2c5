// SPDX-License-Identifier: Apache-2.0
#include "swarm_grammar.hpp"

#include <algorithm>
#include <array>

#include "swarm_rights.hpp"
#include "swarm_text.hpp"

namespace swarm {
namespace {

// ---- writing

// One text that is being made.
class writing {
 public:
  writing(choices& from, const recipe& what, const knowledge& known)
      : from_{from}, what_{what}, known_{known}, of_{operations()[what.operation]} {
    said_.operation = what.operation;
  }

  saying run() {
    switch (of_.goes) {
    case form::rosbridge:
    case form::plain:
    case form::stop_call:
    case form::stop_plain:
    case form::stop_publish: write_object(); break;
    case form::malformed: write_malformed(); break;
    case form::binary:
    case form::control: said_.text = payload(); break;
    case form::close: write_close(); break;
    case form::fragments:
    case form::partial:
      said_.text = "{\"n\":0,\"x\":" + body() + "}";
      if (of_.goes == form::fragments) cut_up();
      break;
    case form::no_frame: write_raw(); break;
    case form::number_text: write_list(); break;
    case form::number_binary: write_by_number(); break;
    case form::number_stop: write_stop_by_number(); break;
    case form::foxglove_text: write_of_foxglove(); break;
    case form::opening: break;
    case form::submission:
    case form::thread_stop: write_for_thread(); break;
    }
    return std::move(said_);
  }

 private:
  struct piece {
    std::string name;
    std::string value;
  };

  std::string_view value_name(std::size_t member) const {
    return classes_of(of_.members[member].is)[what_.classes[member]].name;
  }

  void write_object() {
    std::vector<piece> object;
    std::vector<piece> qos;
    if (of_.goes == form::rosbridge && of_.members[0].is != domain::unsupported &&
        of_.members[0].is != domain::unknown) {
      object.push_back({"op", quoted(of_.op.empty() ? of_.name : of_.op)});
    }
    if (of_.goes == form::stop_call) object.push_back({"op", quoted("call_service")});
    if (of_.goes == form::stop_publish) object.push_back({"op", quoted("publish")});
    std::vector<piece> args;
    std::vector<piece> inner; // what a stop's call has as its arguments
    for (std::size_t i = 0; i < of_.members.size(); ++i) {
      const member_rule& m = of_.members[i];
      const value_class& chosen = classes_of(m.is)[what_.classes[i]];
      if (!chosen.good) said_.good = false;
      if (m.name == "body") {
        add_body(object, m.is, chosen.name);
        continue;
      }
      std::string text = value(m.is, chosen.name);
      note(m, text);
      if (text.empty()) continue;
      if (m.name.starts_with("qos.")) {
        qos.push_back({std::string{m.name.substr(4)}, std::move(text)});
      } else if (m.name.starts_with("args.")) {
        args.push_back({std::string{m.name.substr(5)}, std::move(text)});
      } else if (is_argument(m)) {
        inner.push_back({std::string{m.name}, std::move(text)});
      } else {
        object.push_back({std::string{m.name}, std::move(text)});
      }
    }
    if (!qos.empty()) object.push_back({"qos", joined(qos)});
    if (!args.empty()) object.push_back({"args", joined(args)});
    finish_stop(object, inner);
    if (what_.shuffled && !object.empty())
      std::rotate(object.begin(), object.begin() + static_cast<std::ptrdiff_t>(what_.odd % object.size()),
                  object.end());
    if (what_.doubled && !object.empty()) {
      object.push_back(object[what_.odd % object.size()]);
      said_.good = false;
    }
    said_.text = joined(object);
  }

  bool is_argument(const member_rule& m) const {
    return (of_.goes == form::stop_call || of_.goes == form::stop_publish) && m.is != domain::stop_service &&
           m.is != domain::id && m.is != domain::timeout;
  }

  void finish_stop(std::vector<piece>& object, const std::vector<piece>& inner) {
    if (of_.goes == form::stop_call) object.push_back({"args", joined(inner)});
    if (of_.goes == form::stop_publish) object.push_back({"msg", joined(inner)});
    const bool of_stop =
        of_.goes == form::stop_call || of_.goes == form::stop_plain || of_.goes == form::stop_publish;
    if (!of_stop) return;
    said_.stops = of_.name.starts_with("stop") && of_.name != "stop_state";
    said_.resets = of_.name.starts_with("reset");
  }

  std::string joined(const std::vector<piece>& of) const {
    std::string text = "{";
    for (std::size_t i = 0; i < of.size(); ++i) {
      if (i != 0) text += ',';
      const bool as_escapes = what_.escaped_names && i == what_.odd % of.size();
      text += '"' + (as_escapes ? escaped(of[i].name) : of[i].name) + "\":" + of[i].value;
    }
    return text + '}';
  }

  // What those who record need.
  void note(const member_rule& m, const std::string& text) {
    if (m.is == domain::id) said_.id_raw = text == "null" ? std::string{} : text;
    if (m.is == domain::answered_id) said_.answers = text;
    if (m.is == domain::period) said_.throttle_ms = number_in(text);
    if (m.is == domain::depth && !text.empty()) {
      said_.queue_length = number_in(text); // qos.depth comes later, and wins
      said_.queue_stated = said_.queue_length != 0;
    }
    if (m.name == "latch" && text == "true") said_.latch = true;
    if (m.name == "result" && text == "false") said_.answered_well = false;
    if (m.name == "qos.durability" && text == "\"transient_local\"") said_.latch = true;
    if (m.is == domain::number) said_.number = number_in(text);
    if (m.is == domain::tick || m.is == domain::command_tick) said_.tick = number_in(text);
  }
  static std::int64_t number_in(const std::string& text) {
    if (text.empty() || text.size() > 18 || text.find_first_not_of("0123456789") != std::string::npos)
      return text.empty() ? 0 : -1;
    return std::stoll(text);
  }

  // The members of a plain message, besides the reserved ones.
  void add_body(std::vector<piece>& object, domain is, std::string_view how) {
    if (how == "absent" || how == "empty" || how == "array" || how == "text" || how == "null") return;
    if (how == "number") return object.push_back({"result", "7"});
    if (how == "own_members") return object.push_back({"op", "7"});
    if (how == "names") return object.push_back({"topic", quoted(one_of_few(shared_topics))});
    object.push_back({"n", std::to_string(next_message())});
    object.push_back({"a", "1"});
    object.push_back({"b", "2"});
    if (how != "small") object.push_back({"x", value(is, how)});
  }

  std::uint32_t next_message() {
    if (known_.message_number == nullptr) return 0;
    return said_.message = ++*known_.message_number;
  }

  std::string value(domain is, std::string_view how) {
    if (how == "absent") return {};
    switch (is) {
    case domain::topic: return topic(how);
    case domain::service: return service(how);
    case domain::called_service: return called_service(how);
    case domain::stop_service: return stop_service(how);
    case domain::id: return id(how);
    case domain::answered_id: return answered_id(how);
    case domain::type: return type(how);
    case domain::period: return period(how);
    case domain::fragment_size:
      if (how == "least") return std::to_string(rowe::wire::fragment_size_min);
      if (how == "too_small") return std::to_string(rowe::wire::fragment_size_min - 1);
      return how == "few" ? std::to_string(300 + from_.below(3000)) : count(how);
    case domain::count:
    case domain::depth: return count(how);
    case domain::boolean: return how == "no_boolean" ? "\"yes\"" : std::string{how};
    case domain::compression:
    case domain::level:
    case domain::history:
    case domain::reliability:
    case domain::durability: return how == "no_text" ? "3" : quoted(how);
    case domain::time: return time(how);
    case domain::body: return body_value(how);
    case domain::args:
    case domain::values: return arguments(how);
    case domain::timeout: return seconds(how);
    case domain::ttl: return milliseconds(how);
    case domain::text: return words(how);
    case domain::source: return source(how);
    case domain::guard: return guard(how);
    case domain::number: return stop_number(how);
    case domain::tick: return tick(how);
    case domain::error: return error(how);
    case domain::unsupported: return unsupported(how);
    case domain::unknown: return unknown(how);
    case domain::thread_service: return thread_service(how);
    case domain::submitted: return submitted(how);
    case domain::driven_topic: return topic_of_command(how);
    case domain::command_body: return command_body(how);
    case domain::control_service: return control_service(how);
    case domain::control_state: return control_state(how);
    case domain::control_topic: return control_topic(how);
    case domain::control_action: return control_action(how);
    case domain::driver_name: return driver_name(how);
    case domain::command_tick:
    case domain::control_tick: return control_tick(how);
    case domain::rights_service: return called_rights_service(how);
    case domain::rights_args:
    case domain::rights_asked: return asked_rights(is, how);
    case domain::right: // in that list
    case domain::right_of:
    case domain::payload:
    case domain::raw:
    case domain::list:
    case domain::own_number:
    case domain::channel:
    case domain::called_number:
    case domain::call_number:
    case domain::number_frame:
    case domain::codec:
    case domain::path:
    case domain::address:
    case domain::wait:
    case domain::addressee:
    case domain::outcome:
    case domain::held_call:
    case domain::stop_words:
    case domain::request_id:
    case domain::parameter_list:
    case domain::parameter_value: break;
    }
    return {};
  }

  // ---- names

  template <std::size_t N>
  std::string_view one_of_few(const std::string_view (&all)[N]) {
    return all[from_.below(std::min(known_.names, N))];
  }

  std::string topic(std::string_view how) {
    const std::size_t most = known_.bounds.topic_bytes_max;
    std::string name{one_of_few(shared_topics)};
    std::string written;
    if (how == "own") name = one_of_few(own_topics);
    if (how == "honest") name = from_.one_of(honest_topics);
    if (how == "honest" && !known_.honest_topics && of_.name == "publish") name = "/t0";
    if (how == "made_up") name = "/" + known_.made_up + std::to_string(from_.below(from_.one_in(2) ? 3 : 64));
    if (how == "stats") name = "/rowe/stats";
    if (how == "stop_state") name = "/rowe/stop/state";
    if (how == "stop") name = "/rowe/stop";
    if (how == "reserved") name = "/rowe/other";
    if (how == "longest") name = "/" + std::string(most - 1, 'l');
    if (how == "too_long") name = "/" + std::string(most, 'l');
    if (how == "empty") name = "";
    if (how == "no_text") return "7";
    if (how == "control") written = "/t\\u0001";
    if (how == "escaped") written = "\\/" + escaped(name.substr(1));
    if (how == "no_slash") written = name.substr(1); // the same topic
    said_.topic = name;
    if (how == "stop" && of_.name == "publish") said_.stops = true;
    return quoted(written.empty() ? name : written);
  }

  std::string service(std::string_view how) {
    const std::size_t most = known_.bounds.topic_bytes_max;
    std::string name{one_of_few(shared_services)};
    std::string written;
    if (how == "honest") name = honest_service;
    if (how == "made_up") name = "/" + known_.made_up + std::to_string(from_.below(from_.one_in(2) ? 3 : 64));
    if (how == "stop") name = "/rowe/stop";
    if (how == "reserved") name = "/rowe/other";
    if (how == "longest") name = "/" + std::string(most - 1, 'l');
    if (how == "too_long") name = "/" + std::string(most, 'l');
    if (how == "empty") name = "";
    if (how == "no_text") return "[]";
    if (how == "escaped") written = "\\/" + escaped(name.substr(1));
    if (how == "no_slash") written = name.substr(1); // the same service
    said_.service = name;
    if (how == "stop" && of_.name == "service_response") said_.stops = false;
    return quoted(written.empty() ? name : written);
  }

  std::string called_service(std::string_view how) {
    std::string name{one_of_few(shared_services)};
    if (how == "nobodys") name = "/nobody";
    if (how == "stats") name = "/rowe/stats";
    if (how == "list_topics") name = "/rosapi/topics";
    if (how == "list_services") name = "/rosapi/services";
    if (how == "topic_type") name = "/rosapi/topic_type";
    if (how == "publishers") name = "/rosapi/publishers";
    constexpr std::string_view graph[] = {
        "nodes",       "node_details",        "topics_for_type", "services_for_type",
        "subscribers", "service_providers",   "service_node",    "action_servers",
        "get_time",    "topics_and_raw_types"};
    if (how == "graph") name = "/rosapi/" + std::string{from_.one_of(graph)};
    if (how.find("_param") != std::string_view::npos) name = "/rosapi/" + std::string{how};
    if (how.ends_with("_details")) name = "/rosapi/" + std::string{how};
    if (how == "types") name = "/rowe/types";
    if (how == "record") name = "/rowe/record";
    if (how == "service_type") name = from_.one_in(2) ? "rosapi/service_type" : "/rosapi/service_type";
    if (how == "nobodys" || how == "stats" || name.starts_with("/rowe/") ||
        name.find("rosapi") != std::string::npos) {
      said_.service = name;
      return quoted(name);
    }
    if (how == "with_id") {
      const std::string id = "w" + std::to_string(from_.below(4));
      said_.service = name;
      if (of_.goes == form::rosbridge && said_.id_raw.empty()) said_.id_raw = quoted(id);
      return quoted(name + "#" + id);
    }
    return service(how);
  }

  std::string stop_service(std::string_view how) {
    std::string name = "/rowe/stop";
    if (of_.name.starts_with("reset")) name += "/reset";
    if (of_.name.starts_with("heartbeat")) name += "/guard";
    if (of_.name == "stop_state") name += "/state";
    said_.service = name;
    std::string written = name;
    if (how == "no_slash") written = name.substr(1);
    if (how == "escaped_slash") written = "\\/rowe\\/stop" + name.substr(10);
    if (how == "escaped_characters") written = "/rowe/" + escaped("st") + "op" + name.substr(10);
    const bool with_id = how == "with_id" || how == "with_long_id";
    if (with_id && of_.goes == form::stop_call) {
      const std::string id = how == "with_id" ? "st" + std::to_string(from_.below(4)) : std::string(60, 's');
      if (said_.id_raw.empty()) service_id_ = quoted(id);
      written += "#" + id;
    }
    return quoted(written);
  }

  // ---- ids

  std::string id(std::string_view how) {
    std::string text = quoted("i" + std::to_string(from_.below(known_.names)));
    if (how == "number") text = std::to_string(from_.below(8));
    if (how == "negative") text = "-7";
    if (how == "again" && !known_.own_calls.empty())
      text = known_.own_calls[from_.below(known_.own_calls.size())];
    if (how == "escaped") text = "\"\\u0041\\\"\\n" + std::to_string(from_.below(4)) + "\\/\"";
    if (how == "longest") text = quoted(std::string(254, 'i'));
    if (how == "null") text = "null";
    if (how == "empty") text = "\"\"";
    if (how == "too_long") text = quoted(std::string(255, 'i'));
    if (how == "fraction") text = "1.5";
    if (how == "object") text = "{}";
    return text;
  }

  std::string answered_id(std::string_view how) {
    const auto one = [&](const std::vector<std::string>& of) {
      return of.empty() ? std::string{"\"1.1.1.1\""} : of[from_.below(of.size())];
    };
    if (how == "asked") return one(known_.asked);
    if (how == "answered") return one(known_.answered);
    if (how == "of_others") return one(known_.asked_of_others);
    if (how == "longest") return quoted(std::string(254, '1'));
    if (how == "too_long") return quoted(std::string(255, '1'));
    if (how == "object") return "{}";
    std::string made = one(known_.asked);
    if (made.size() > 3) made[made.size() / 2] = made[made.size() / 2] == '1' ? '2' : '1';
    return made;
  }

  std::string type(std::string_view how) const {
    const std::size_t most = known_.bounds.topic_bytes_max;
    if (how == "usual") return "\"sim/Usual\"";
    if (how == "other") return "\"sim/Other\"";
    if (how == "empty") return "\"\"";
    if (how == "longest") return quoted(std::string(most, 'T'));
    if (how == "too_long") return quoted(std::string(most + 1, 'T'));
    return "7";
  }

  // ---- numbers

  std::string period(std::string_view how) {
    constexpr std::string_view shorts[] = {"5", "20", "50", "100"};
    constexpr std::string_view longs[] = {"500", "1000", "3000"};
    if (how == "zero") return "0";
    if (how == "one") return "1";
    if (how == "short") return std::string{from_.one_of(shorts)};
    if (how == "long") return std::string{from_.one_of(longs)};
    if (how == "hour") return "3600000";
    if (how == "largest") return "9223372036854";
    if (how == "too_large") return "9223372036855";
    if (how == "beyond_64_bits") return "9223372036854775808";
    if (how == "negative") return "-1";
    if (how == "fraction") return "0.5";
    return "\"50\"";
  }

  std::string count(std::string_view how) {
    const std::uint64_t limit = known_.bounds.queue_depth_max;
    if (how == "zero") return "0";
    if (how == "one") return "1";
    if (how == "some" || how == "few") return std::to_string(2 + from_.below(7));
    if (how == "limit_less_one") return std::to_string(limit - 1);
    if (how == "limit") return std::to_string(limit);
    if (how == "limit_and_one") return std::to_string(limit + 1);
    if (how == "huge") return "9223372036854775807";
    if (how == "beyond_64_bits") return "9223372036854775808";
    if (how == "negative") return "-1";
    if (how == "fraction") return "1.5";
    return "\"1\"";
  }

  std::string time(std::string_view how) {
    if (how == "zero") return "0";
    if (how == "short") return from_.one_in(2) ? "0.02" : "0.5";
    if (how == "secs_nsecs") return R"({"secs":0,"nsecs":50000000})";
    if (how == "infinite") return "\"infinite\"";
    if (how == "huge") return "1e300";
    if (how == "negative") return "-0.5";
    return "[]";
  }

  std::string seconds(std::string_view how) {
    constexpr std::string_view shorts[] = {"0.001", "0.02", "0.1"};
    if (how == "zero") return "0";
    if (how == "short") return std::string{from_.one_of(shorts)};
    if (how == "long") return "2";
    if (how == "huge") return "1e300";
    if (how == "negative") return "-1";
    return "\"1\"";
  }

  std::string milliseconds(std::string_view how) {
    constexpr std::string_view shorts[] = {"1", "20", "100"};
    if (how == "zero") return "0";
    if (how == "short") return std::string{from_.one_of(shorts)};
    if (how == "fraction") return "0.25";
    if (how == "long") return "2000";
    if (how == "huge") return "1e300";
    if (how == "negative") return "-1";
    return "\"1\"";
  }

  // ---- bodies

  // How long a filling must be, so that a message with the usual envelope has about so many bytes.
  std::size_t filling(std::string_view how) {
    const std::size_t envelope = of_.goes == form::rosbridge ? 60 : 40;
    const std::size_t small = known_.bounds.small_slot_bytes;
    const std::size_t most = known_.bounds.message_bytes_max;
    if (how == "small_slot_less_one") return small - envelope - 1;
    if (how == "small_slot") return small - envelope;
    if (how == "small_slot_and_one") return small - envelope + 1;
    if (how == "large") return small + from_.below(most / 2);
    if (how == "largest") return most - 400;
    return from_.below(30);
  }
  std::string deep(std::size_t levels) const { return std::string(levels, '[') + std::string(levels, ']'); }

  std::string body_value(std::string_view how) {
    if (of_.goes == form::plain) {
      if (how == "deep") return deep(known_.bounds.depth_max - 2);
      if (how == "too_deep") return deep(known_.bounds.depth_max);
      return quoted(std::string(filling(how), 'x'));
    }
    if (how == "empty") return "{}";
    if (how == "array") return "[1]";
    if (how == "text") return "\"text\"";
    const std::string n = "{\"n\":" + std::to_string(next_message());
    if (how == "small") return n + "}";
    if (how == "deep") return n + ",\"x\":" + deep(known_.bounds.depth_max - 3) + "}";
    if (how == "too_deep") return n + ",\"x\":" + deep(known_.bounds.depth_max) + "}";
    if (how == "own_members") return n + R"(,"op":"publish","topic":"/t0","id":7})";
    return n + ",\"x\":" + quoted(std::string(filling(how), 'x')) + "}";
  }
  std::string body() {
    const std::string_view how = value_name(0);
    if (how == "too_deep") said_.good = false;
    if (how == "too_deep") return deep(known_.bounds.depth_max);
    if (how == "deep") return deep(known_.bounds.depth_max - 2);
    return quoted(std::string(filling(how), 'x'));
  }

  std::string arguments(std::string_view how) {
    if (of_.goes == form::plain) return quoted(std::string(filling(how), 'x'));
    if (how == "names") return known_names();
    if (how == "small") return R"({"a":1,"b":2})";
    if (how == "empty") return "{}";
    if (how == "array") return "[1,2]";
    if (how == "number") return "7";
    if (how == "null") return "null";
    if (how == "text") return "\"why\"";
    if (how == "own_members") return R"({"a":1,"b":2,"service":"x","message_id":7,"in_reply_to":7,"op":7})";
    return "{\"a\":1,\"b\":2,\"x\":" + quoted(std::string(filling(how), 'x')) + "}";
  }

  // What the services that list ask for.
  std::string known_names() {
    const std::string topic{from_.one_in(2) ? one_of_few(shared_topics) : one_of_few(own_topics)};
    constexpr std::string_view parameters[] = {"/p0", "p1", "/p2", "/rowe/limits/topics_max", "/none"};
    constexpr std::string_view values[] = {R"("3")", "2", R"("5")", R"("\"a\"")", "null", R"("[1")"};
    const std::string causes[] = {"\"why\"",
                                  "null",
                                  "7",
                                  quoted(escaped("line") + "\\n\\u0000"),
                                  quoted(std::string(256, 'c')),
                                  quoted(std::string(257, 'c'))};
    const bool writes = from_.one_in(2);
    return std::string{writes ? "{" : "{\"write\":false,"} + "\"cause\":" + from_.one_of(causes) +
           ",\"topic\":\"" + topic + "\",\"service\":\"" + std::string{one_of_few(shared_services)} +
           "\",\"node\":\"robot\",\"type\":\"sim/Usual\",\"name\":\"" +
           std::string{from_.one_of(parameters)} + "\",\"value\":" + std::string{from_.one_of(values)} + "}";
  }

  std::string words(std::string_view how) const {
    if (how == "short") return "\"text\"";
    if (how == "empty") return "\"\"";
    if (how == "escaped") return "\"\\u0000\\n\\\\\\\"\"";
    if (how == "long") return quoted(std::string(3000, 't'));
    return "7";
  }

  // ---- the stop

  std::string source(std::string_view how) {
    if (how == "one") return "\"panel\"";
    if (how == "one_of_many") return quoted("s" + std::to_string(from_.below(1000)));
    if (how == "longest") return quoted(std::string(63, 's'));
    if (how == "long_escaped") return quoted(escaped(std::string(40 + from_.below(60), 's')));
    if (how == "empty") return "\"\"";
    return "7";
  }
  std::string guard(std::string_view how) {
    if (how == "one") return "\"guard\"";
    if (how == "one_of_few") return quoted("g" + std::to_string(from_.below(3)));
    if (how == "one_of_many") return quoted("g" + std::to_string(from_.below(20)));
    if (how == "longest") return quoted(std::string(31, 'g'));
    if (how == "escaped") return quoted(escaped("guard"));
    if (how == "too_long") return quoted(std::string(32, 'g'));
    return "\"a b\\u0000\"";
  }
  std::string stop_number(std::string_view how) {
    const auto& old = known_.old_stops;
    if (how == "newest") return std::to_string(known_.stop_number);
    if (how == "old" && !old.empty()) return std::to_string(old[what_.odd % old.size()].first);
    if (how == "next") return std::to_string(known_.stop_number + 1);
    if (how == "low_16_bits") return std::to_string(known_.stop_number & 0xffff);
    if (how == "zero") return "0";
    if (how == "negative") return "-1";
    if (how == "huge") return "9007199254740993";
    return "\"1\"";
  }
  std::string tick(std::string_view how) {
    const auto& old = known_.old_stops;
    if (how == "newest") return std::to_string(known_.tick);
    if (how == "old" && !old.empty()) return std::to_string(old[what_.odd % old.size()].second);
    if (how == "before_last")
      return std::to_string(known_.tick - static_cast<std::int64_t>(from_.below(100)));
    if (how == "future")
      return std::to_string(known_.tick + 1 + static_cast<std::int64_t>(from_.below(1000)));
    if (how == "zero") return "0";
    if (how == "huge") return "9223372036854775807";
    return "\"1\"";
  }

  // ---- driving

  std::string topic_of_command(std::string_view how) {
    said_.topic = how == "other" ? one_of_few(shared_topics) : driven_topic;
    return quoted(how == "no_slash" ? driven_topic.substr(1) : std::string_view{said_.topic});
  }
  std::string command_body(std::string_view how) {
    if (how == "array") return "[1]";
    const std::string n = "{\"n\":" + std::to_string(next_message());
    if (how == "missing") return n + "}";
    if (how == "null") return n + ",\"x\":null}";
    if (how == "text") return n + ",\"x\":\"fast\"}";
    if (how == "infinite") return n + ",\"x\":1e999}";
    if (how == "fraction") return n + ".5,\"x\":0.5}";
    if (how == "more") return n + R"(,"x":0.5,"y":[{"x":null}],"op":"take"})";
    if (how == "large") return n + ",\"x\":0.5,\"more\":" + quoted(std::string(filling("large"), 'x')) + "}";
    return n + ",\"x\":0.5}";
  }
  std::string control_service(std::string_view how) {
    said_.service = "/rowe/control";
    if (how == "no_slash") return quoted("rowe/control");
    if (how == "escaped") return quoted("\\/rowe\\/" + escaped("co") + "ntrol");
    if (how == "with_id" && of_.goes == form::rosbridge) {
      const std::string id = "co" + std::to_string(from_.below(4));
      if (said_.id_raw.empty()) service_id_ = quoted(id);
      return quoted(said_.service + "#" + id);
    }
    return quoted(said_.service);
  }
  std::string control_state(std::string_view how) {
    said_.topic = "/rowe/control/state";
    if (how == "no_slash") return quoted(said_.topic.substr(1));
    return quoted(how == "escaped" ? "\\/rowe\\/control\\/" + escaped("state") : said_.topic);
  }
  std::string control_topic(std::string_view how) {
    if (how == "driven") return quoted(driven_topic);
    if (how == "no_slash") return quoted(driven_topic.substr(1));
    if (how == "other") return quoted(from_.one_in(2) ? one_of_few(shared_topics) : own_topics[0]);
    if (how == "long") return quoted(std::string(400, 't'));
    return how == "empty" ? "\"\"" : "[7]";
  }
  std::string control_action(std::string_view how) {
    if (how == "unknown") return "\"fly\"";
    if (how == "empty") return "\"\"";
    if (how == "long") return quoted(std::string(400, 'a'));
    return how == "no_text" ? "{}" : quoted(how);
  }
  std::string driver_name(std::string_view how) {
    if (how == "short") return quoted("phone-" + std::to_string(from_.below(3)));
    if (how == "of_this_process") return "\"this process\"";
    if (how == "escaped") return R"("a\"},{\"driver\":\"b\u0000\n\ud83d\ude00")";
    if (how == "longest") return quoted(std::string(64, 'n'));
    if (how == "long") return quoted(std::string(from_.one_in(2) ? 200 : 400, 'n'));
    return how == "empty" ? "\"\"" : "7";
  }
  std::string control_tick(std::string_view how) {
    const auto ago = [&](std::uint64_t most) {
      return std::to_string(known_.control_tick - static_cast<std::int64_t>(from_.below(most)));
    };
    if (how == "newest") return std::to_string(known_.control_tick);
    if (how == "before_last") return ago(100);
    if (how == "old") return ago(5000);
    if (how == "future")
      return std::to_string(known_.control_tick + 1 + static_cast<std::int64_t>(from_.below(1000)));
    if (how == "zero") return "0";
    if (how == "huge") return "9223372036854775807";
    if (how == "beyond_64_bits") return "9223372036854775808";
    if (how == "negative") return "-5";
    if (how == "fraction") return "0.5";
    return how == "null" ? "null" : "\"soon\"";
  }

  // ---- what it may do

  std::string called_rights_service(std::string_view how) {
    said_.service = rights_service;
    said_.asks_rights = true;
    if (how == "no_slash") return quoted(rights_service.substr(1));
    if (how == "escaped") return quoted("\\/rowe\\/" + escaped("ri") + "ghts");
    if (how == "with_id" && of_.goes == form::rosbridge) {
      const std::string id = "ri" + std::to_string(from_.below(4));
      if (said_.id_raw.empty()) service_id_ = quoted(id);
      return quoted(said_.service + "#" + id);
    }
    return quoted(rights_service);
  }
  std::string asked_rights(domain is, std::string_view how) {
    rights_question question{from_, value_named("right"), value_named("of")};
    std::string text = is == domain::rights_args ? question.arguments(how) : question.text(how);
    said_.rights = std::move(question.asked);
    return text;
  }

  // ---- the rest

  std::string error(std::string_view how) {
    if (how == "usual") return R"({"code":"no","text":"no"})";
    if (how == "no_service") return R"({"code":"no_service","text":"nothing here"})";
    if (how == "long") return R"({"code":"no","text":")" + escaped(std::string(400, 'e')) + "\"}";
    if (how == "no_code") return "{}";
    return "7";
  }
  std::string unsupported(std::string_view how) { return quoted(how); }
  std::string unknown(std::string_view how) const {
    if (how == "word") return "\"hello\"";
    if (how == "escaped") return quoted(escaped("subscribed"));
    if (how == "longest") return quoted(std::string(64, 'o'));
    if (how == "too_long") return quoted(std::string(65, 'o'));
    if (how == "empty") return "\"\"";
    return "\"\\u0007\"";
  }

  void write_malformed() {
    constexpr std::string_view texts[] = {"{\"op\":",
                                          "",
                                          "nonsense",
                                          "{\"op\":\"publish\",\"msg\":NaN}",
                                          "[1,2",
                                          "\xff\xfe{}",
                                          "{\"op\":\"\\ud800\"}",
                                          "1e400",
                                          "{} {}"};
    said_.good = false;
    said_.text = texts[what_.odd % std::size(texts)];
    if (value_name(0) == "long") said_.text = "[" + std::string(known_.bounds.message_bytes_max / 2, ' ');
    if (value_name(0) == "escaped") said_.text = "\"\\x\"";
    // a stop in such a text is mistyped, so it is none
    if (value_name(0) == "no_text") said_.text = R"({"op":"call_service","service":"/rowe/stop")";
  }

  std::string payload() const {
    const std::string_view how = value_name(0);
    return how == "empty" ? std::string{} : std::string(how == "short" ? 5 : 125, 'p');
  }
  void write_close() {
    constexpr std::uint16_t codes[] = {1000, 1001, 1003, 3000, 4999, 999, 1005, 5000};
    std::string text = payload();
    if (text.size() >= 2) {
      const std::uint16_t code = codes[what_.odd % std::size(codes)];
      text[0] = static_cast<char>(code >> 8);
      text[1] = static_cast<char>(code & 0xff);
    }
    said_.text = text;
  }

  void cut_up() {
    const std::size_t parts = 2 + from_.below(5);
    std::string_view rest = said_.text;
    for (std::size_t i = 0; i < parts; ++i) {
      const std::size_t bytes = i + 1 == parts ? rest.size() : from_.below(rest.size() + 1);
      said_.parts.emplace_back(rest.substr(0, bytes));
      rest.remove_prefix(bytes);
    }
  }

  // The first bytes are those of a client's frame; the world has no part in it.
  void write_raw() {
    const std::string_view how = value_name(0);
    said_.good = false;
    using namespace std::string_view_literals;
    if (how == "reserved_bits") said_.text = "\xf1\x80\x01\x02\x03\x04"sv;
    if (how == "reserved_opcode") said_.text = "\x83\x80\x01\x02\x03\x04"sv;
    if (how == "long_control") said_.text = "\x89\xfe\x00\x80\x01\x02\x03\x04"sv;
    if (how == "unmasked") said_.text = "\x81\x02{}"sv;
    if (how == "continuation") said_.text = "\x80\x80\x01\x02\x03\x04"sv;
    if (how == "huge_length") said_.text = "\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\x01\x02\x03\x04"sv;
    if (how == "random") {
      for (std::uint64_t left = 1 + from_.below(40); left > 0; --left)
        said_.text += static_cast<char>(from_.below(256));
    }
  }

  // ---- the codec with numbers

  std::size_t place_of(std::string_view member) const {
    std::size_t at = 0;
    while (of_.members[at].name != member) ++at;
    return at;
  }
  std::string_view value_named(std::string_view member) const { return value_name(place_of(member)); }
  void note_goodness() {
    for (std::size_t i = 0; i < of_.members.size(); ++i) {
      if (!classes_of(of_.members[i].is)[what_.classes[i]].good) said_.good = false;
    }
  }

  std::string own_number(std::string_view how, const std::map<std::uint32_t, std::string>& used,
                         numbered& into) {
    if (how == "too_large") return "4294967295";
    if (how == "negative") return "-1";
    if (how == "no_number") return "\"1\"";
    into.number = static_cast<std::uint32_t>(from_.below(known_.names));
    if (how == "largest") into.number = rowe::wire::no_number - 1;
    const bool publishes = of_.name == "publish_by_number";
    if (how != "largest" && !used.empty() && (how == "used" || (publishes && !from_.one_in(4)))) {
      // Rather a topic of this process, if it is one of them.
      auto chosen = std::next(used.begin(), static_cast<std::ptrdiff_t>(from_.below(used.size())));
      for (auto one = used.begin(); publishes && one != used.end() && !chosen->second.starts_with("/own");
           ++one)
        if (one->second.starts_with("/own")) chosen = one;
      into.number = chosen->first;
    }
    return std::to_string(into.number);
  }
  // One that is listed and of which `is(name)` holds; no_number where there is none.
  template <class Is>
  std::uint32_t listed_number(const number_list& in, Is&& is) {
    std::vector<std::uint32_t> fit;
    for (const auto& [number, name] : in.names()) {
      if (is(name)) fit.push_back(number);
    }
    return fit.empty() ? rowe::wire::no_number : fit[from_.below(fit.size())];
  }
  std::uint32_t gone_number(const number_list& in) {
    return in.gone().empty() ? in.most() + 1 : in.gone()[from_.below(in.gone().size())];
  }
  std::string channel(std::string_view how, numbered& into) {
    if (how == "too_large") return "4294967295";
    if (how == "no_number") return "\"1\"";
    const number_list& topics = known_.listed.topics;
    std::uint32_t number = listed_number(topics, [&](const std::string& name) {
      return how == "listed" || (how == "shared" && name.starts_with("/t")) ||
             (how == "own" && name.starts_with("/own")) ||
             (how == "honest" && (name == honest_topics[0] || name == honest_topics[1])) ||
             (how == "endpoints" && name.starts_with("/rowe/"));
    });
    if (how == "gone") number = gone_number(topics);
    if (how == "largest") number = rowe::wire::no_number - 1;
    if (number == rowe::wire::no_number)
      number = topics.most() + 1 + static_cast<std::uint32_t>(from_.below(9));
    into.topic = topics.name_of(number);
    said_.topic = into.topic;
    return std::to_string(number);
  }

  std::string list_element() {
    numbered one;
    const bool of_tags = of_.name == "want" || of_.name == "drop";
    const auto& used = of_tags ? known_.tags : known_.channels;
    const std::string number = own_number(value_name(1), used, one);
    std::string text = number;
    if (of_.name == "want") {
      const std::string of_topic = channel(value_named("topic"), one);
      text = in_foxglove() ? R"({"id":)" + number + R"(,"channelId":)" + of_topic + "}"
                           : "[" + number + "," + of_topic + "]";
    }
    if (of_.name == "offer") {
      const std::string name = topic(value_named("topic"));
      text = "[" + number + (name.empty() ? "]" : "," + name + "]");
      if (in_foxglove())
        text = R"({"encoding":"json","schemaName":"test/Of","id":)" + number +
               (name.empty() ? "}" : R"(,"topic":)" + name + "}");
      one.topic = said_.topic;
    }
    if (const auto found = used.find(one.number); found != used.end() && one.topic.empty()) {
      one.topic = found->second;
      if (of_.name == "drop" || of_.name == "keep") said_.topic = one.topic;
    }
    said_.elements.push_back(one);
    return text;
  }
  void write_list() {
    note_goodness();
    const std::string_view how = value_name(0);
    std::string list = list_element();
    if (how == "flat") list = list.starts_with('[') ? list.substr(1, list.size() - 2) : "[" + list + "]";
    if (how == "flat" && in_foxglove()) list = "null";
    if (how == "twice") {
      list += "," + list;
    } else if (how == "two" || how == "many") {
      for (std::size_t left = how == "two" ? 1 : 70; left > 0; --left) list += "," + list_element();
    }
    list = how == "empty" ? "[]" : how == "no_list" ? "7" : "[" + list + "]";
    said_.text = "{" + quoted(of_.name) + ":" + list + "}";
    if (!in_foxglove()) return;
    const bool of_tags = of_.name == "want" || of_.name == "drop";
    const std::string_view op = of_.name == "want"    ? "subscribe"
                                : of_.name == "drop"  ? "unsubscribe"
                                : of_.name == "offer" ? "advertise"
                                                      : "unadvertise";
    const std::string_view name = of_.name == "want"    ? "subscriptions"
                                  : of_.name == "offer" ? "channels"
                                  : of_tags             ? "subscriptionIds"
                                                        : "channelIds";
    said_.text = R"({"op":)" + quoted(op) + "," + quoted(name) + ":" + list + "}";
  }
  bool in_foxglove() const { return known_.speaks == tongue::foxglove; }

  // ---- what only Foxglove's protocol has

  std::string request_id(std::string_view how) {
    if (how == "short") return quoted("q" + std::to_string(from_.below(known_.names)));
    if (how == "longest") return quoted(std::string(254, 'q'));
    if (how == "too_long") return quoted(std::string(255, 'q'));
    return how == "no_text" ? "7" : std::string{};
  }
  std::string parameter_name(std::string_view how) {
    if (how == "endpoints") return quoted("/rowe/limits/topics_max");
    if (how == "nobodys") return quoted("/nobodys" + std::to_string(from_.below(64)));
    if (how == "odd") return from_.one_in(2) ? quoted("") : quoted(std::string(300, 'p'));
    return quoted("/p" + std::to_string(from_.below(3)));
  }
  std::string parameter_list(std::string_view how) {
    if (how == "no_list") return "7";
    if (how == "no_text") return "[7]";
    std::string list = how == "all" ? std::string{} : parameter_name(how);
    for (std::size_t left = how == "many" ? 40 : how == "known" ? 1 : 0; left > 0; --left)
      list += "," + parameter_name(left % 2 == 0 ? "nobodys" : how);
    return "[" + list + "]";
  }
  std::string parameter(std::string_view how) {
    if (how == "no_object") return "7";
    if (how == "no_name") return R"({"value":1})";
    if (how == "bytes") return R"({"name":"/p0","type":"byte_array","value":"AAAA"})";
    std::string text = R"({"name":)" + parameter_name(how);
    if (how == "no_value") return text + "}";
    text += R"(,"value":)";
    text += how == "text"        ? R"("x")"
            : how == "list"      ? "[1,2]"
            : how == "too_large" ? "1e300"
                                 : std::to_string(from_.below(8));
    return text + "}";
  }
  void write_of_foxglove() {
    note_goodness();
    std::vector<piece> object{{"op", quoted(of_.name == "get_parameters"     ? "getParameters"
                                            : of_.name == "set_parameters"   ? "setParameters"
                                            : of_.name == "watch_parameters" ? "subscribeParameterUpdates"
                                            : of_.name == "watch_graph"      ? "subscribeConnectionGraph"
                                            : of_.name == "unwatch_graph"    ? "unsubscribeConnectionGraph"
                                                                          : "unsubscribeParameterUpdates")}};
    for (std::size_t i = 0; i < of_.members.size(); ++i) {
      const std::string_view how = value_name(i);
      const domain is = of_.members[i].is;
      std::string text = is == domain::request_id       ? request_id(how)
                         : how == "absent"              ? std::string{}
                         : is == domain::parameter_list ? parameter_list(how)
                                                        : "[" + parameter(how) + "," + parameter(how) + "]";
      if (is == domain::request_id) said_.id_raw = text;
      if (!text.empty()) object.push_back({std::string{of_.members[i].name}, std::move(text)});
    }
    said_.text = joined(object);
  }

  std::string number_id(std::string_view how) {
    if (how == "zero") return numbers::four(0);
    if (how == "largest") return numbers::four(UINT32_MAX);
    if (how == "quotes") return "\"\\}\"";
    if (how == "again" && !known_.own_calls.empty())
      return known_.own_calls[from_.below(known_.own_calls.size())];
    return numbers::four(1 + static_cast<std::uint32_t>(from_.below(known_.names)));
  }
  std::uint32_t service_number(std::string_view how) {
    const number_list& services = known_.listed.services;
    const bool any = from_.one_in(4); // else those of peers and of this process, where there are any
    std::uint32_t number = listed_number(services, [&](const std::string& name) {
      const bool of_stop = name.starts_with("/rowe/stop"); // which have operations of their own
      return (how == "listed" && !of_stop && (any || name.starts_with("/s"))) ||
             (how == "shared" && name.starts_with("/s")) || (how == "honest" && name == honest_service) ||
             (how == "stats" && name == "/rowe/stats") || (how == "lists" && name.starts_with("/rosapi/"));
    });
    if (how == "gone") number = gone_number(services);
    if (how == "zero") number = 0;
    if (how == "largest") number = rowe::wire::no_number - 1;
    if (number == rowe::wire::no_number)
      number = services.most() + 1 + static_cast<std::uint32_t>(from_.below(9));
    said_.service = services.name_of(number);
    return number;
  }

  void write_by_number() {
    note_goodness();
    if (of_.members[0].is == domain::number_frame) return write_no_number_frame();
    if (of_.name == "call_by_number") {
      const std::uint32_t number = service_number(value_named("service"));
      said_.id_raw = number_id(value_named("id"));
      const std::string args = value(domain::args, value_named("args"));
      if (!args.empty() && args.front() != '{') said_.good = false;
      said_.text = call_of(number, args);
      return;
    }
    said_.text = "x";
    if (of_.name == "publish_by_number") {
      numbered one;
      own_number(value_named("channel"), known_.channels, one); // one that is no number is the largest
      const auto found = known_.channels.find(one.number);
      if (found != known_.channels.end()) said_.topic = found->second;
      said_.text = (in_foxglove() ? "\x01" : "p") + numbers::four(one.number);
    }
    said_.text += value(domain::body, value_named("msg"));
  }

  std::string call_of(std::uint32_t service, const std::string& args) const {
    return in_foxglove() ? foxglove::call(service, said_.id_raw, args)
                         : "c" + numbers::four(service) + said_.id_raw + args;
  }

  // Both protocols have a message and a call there.
  void write_no_number_frame() {
    write_no_frame_of_numbers();
    if (!in_foxglove() || said_.text.empty() || value_name(0) == "random") return;
    if (said_.text.front() == 'p') said_.text.front() = '\x01';
    if (said_.text.front() == 'c') said_.text.front() = '\x02';
    if (said_.text.front() == 'T') said_.text.front() = '\x03';
  }
  void write_no_frame_of_numbers() {
    constexpr std::string_view first_bytes[] = {"p", "c", "x", "h"};
    const std::string_view how = value_name(0);
    if (how == "unknown") said_.text = "q" + numbers::four(1) + "{}";
    if (how == "first_byte") said_.text = first_bytes[what_.odd % std::size(first_bytes)];
    if (how == "cut_publish") said_.text = "p" + numbers::four(1).substr(what_.odd % 4);
    if (how == "cut_call") said_.text = "c" + numbers::four(1) + std::string(what_.odd % 4, 'i');
    if (how == "servers") said_.text = "T" + numbers::four(1) + numbers::four(2) + "/t";
    if (how == "no_json") said_.text = "p" + numbers::four(0) + "{\"a\":";
    if (how == "random") {
      for (std::uint64_t left = 1 + from_.below(40); left > 0; --left)
        said_.text += static_cast<char>(from_.below(256));
    }
  }

  void write_stop_by_number() {
    note_goodness();
    std::vector<piece> inner;
    for (std::size_t i = 1; i < of_.members.size(); ++i) {
      const member_rule& m = of_.members[i];
      std::string text = value(m.is, value_name(i));
      note(m, text);
      if (!text.empty()) inner.push_back({std::string{m.name}, std::move(text)});
    }
    const std::uint32_t number = of_.name.starts_with("stop") ? 1 : of_.name.starts_with("reset") ? 2 : 3;
    said_.id_raw = number_id(value_named("id"));
    said_.text = call_of(number, joined(inner));
    said_.stops = number == 1;
    said_.resets = number == 2;
  }

  // ---- ordinary threads

  std::string thread_service(std::string_view how) {
    if (how == "stop") return quoted("/rowe/stop");
    if (how == "reset") return quoted("/rowe/stop/reset");
    if (how == "guard") return quoted("/rowe/stop/guard");
    if (how == "lists") return called_service(from_.one_in(2) ? "list_topics" : "list_services");
    return called_service(how);
  }
  std::string submitted(std::string_view how) const {
    const std::size_t most = known_.bounds.door_slot_bytes;
    if (how == "small") return R"({"sum":3})";
    if (how == "stop") return R"({"service":"/rowe/stop"})";
    if (how == "array") return "[]";
    if (how == "torn") return "[";
    if (how == "empty") return {};
    const std::size_t bytes = how == "large" ? most / 2 : how == "largest" ? most : most + 1;
    return "{\"x\":\"" + std::string(bytes - 8, 'x') + "\"}";
  }
  void write_for_thread() {
    note_goodness();
    for (std::size_t i = 0; i < of_.members.size(); ++i) {
      const member_rule& m = of_.members[i];
      if (m.is == domain::submitted) said_.text = submitted(value_name(i));
      if (m.is == domain::number) note(m, value(m.is, value_name(i)));
    }
    if (of_.name == "thread_refusal") said_.text = plain(value(domain::source, value_named("why")));
    if (of_.name != "thread_call") return;
    const std::string_view service = value_named("service");
    std::vector<piece> object;
    if (service != "absent") object.push_back({"service", value(domain::thread_service, service)});
    add_body(object, domain::args, value_named("args"));
    if (service == "reset") {
      said_.resets = true;
      said_.number = known_.stop_number;
      said_.tick = known_.tick;
      object.push_back({"number", std::to_string(said_.number)});
      object.push_back({"tick", std::to_string(said_.tick)});
    }
    said_.text = joined(object);
  }
  // A text without its quotes.
  static std::string plain(const std::string& json) {
    return json.size() < 2 || json.front() != '"' ? json : json.substr(1, json.size() - 2);
  }

  choices& from_;
  const recipe& what_;
  const knowledge& known_;
  const operation& of_;
  saying said_;

 public:
  std::string service_id_; // of "#id"
};

} // namespace

std::string_view value_of(const recipe& what, std::string_view member) {
  const auto& members = operations()[what.operation].members;
  for (std::size_t m = 0; m < what.classes.size(); ++m) {
    if (members[m].name == member) return classes_of(members[m].is)[what.classes[m]].name;
  }
  return {};
}

void give_value(recipe& to, std::string_view member, std::string_view value) {
  const auto& members = operations()[to.operation].members;
  for (std::size_t m = 0; m < to.classes.size(); ++m) {
    const auto& classes = classes_of(members[m].is);
    const auto found =
        std::find_if(classes.begin(), classes.end(), [&](const auto& one) { return one.name == value; });
    if (members[m].name == member && found != classes.end())
      to.classes[m] = static_cast<std::size_t>(found - classes.begin());
  }
}

recipe choose_recipe(choices& from, const weights& use, std::size_t operation, std::uint64_t bad_in) {
  const auto& members = operations()[operation].members;
  recipe result{.operation = operation};
  const bool has_bad = bad_in != 0 && from.one_in(bad_in);
  const std::size_t bad_one = members.empty() ? 0 : from.below(members.size());
  for (std::size_t m = 0; m < members.size(); ++m) {
    const auto& classes = classes_of(members[m].is);
    const bool may_be_bad = has_bad && m == bad_one;
    const std::size_t first = row_of(operation, m, 0);
    const auto good = [&](std::size_t i) { return classes[i].good; };
    const auto any_bad = [&](std::size_t i) { return !classes[i].good; };
    std::size_t chosen = classes.size();
    if (may_be_bad) chosen = use.choose(from, first, classes.size(), classes.size(), any_bad);
    if (chosen == classes.size()) chosen = use.choose(from, first, classes.size(), 0, good);
    result.classes.push_back(chosen);
  }
  result.shuffled = from.one_in(8);
  result.doubled = has_bad && from.one_in(4);
  result.escaped_names = from.one_in(16);
  result.odd = static_cast<std::size_t>(from.below(1 << 16));
  return result;
}

saying render(choices& from, const recipe& what, const knowledge& known) {
  writing one{from, what, known};
  saying said = one.run();
  if (said.id_raw.empty() && !one.service_id_.empty()) said.id_raw = one.service_id_;
  return said;
}

} // namespace swarm
