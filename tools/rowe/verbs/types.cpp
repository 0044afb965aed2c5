// SPDX-License-Identifier: Apache-2.0
// rowe types: declarations of the types that an endpoint's program gave its topics and services; from its
// service /rowe/types, page after page.
#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/types.hpp>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_types.hpp"
#include "../output.hpp"
#include "../text/c_tables.hpp"
#include "../text/json_values.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration types_timeout = 2s;

struct types_settings {
  remote_place at;
  std::optional<rt::duration> timeout;
  bool ts = false;
  bool json_schema = false;
  bool ros = false;
  bool c = false;
};

command types_table(types_settings& o) {
  return {
      .verb = "types",
      .examples = {{{"rowe types ws://127.0.0.1:8080 > robot.ts", "declarations for TypeScript"},
                    {"rowe types 127.0.0.1:8080 --c > robot_types.h", "structs and tables for C"}}},
      .description =
          "Prints the types that the program of an endpoint gave its topics and services by schemas, and\n"
          "those of the endpoint's own. Topics and services of others, and those with JSON text, have "
          "none.\n",
      .operands = {url_operand(o.at.url)},
      .options = with_remote(
          o.at,
          {
              {"--ts", "", "", "declarations for TypeScript, as without a form", &o.ts},
              {"--json-schema", "", "", "one JSON object: topics and services, by name", &o.json_schema},
              {"--ros", "", "", "the text of each message in ROS", &o.ros},
              {"--c", "", "", "structs and tables for C (rowe/struct.h)", &o.c},
              {"--timeout", "", "TIME", "for the connection and for each answer (default 2s)",
               time_span{&o.timeout}},
          })};
}

// "/arm/add request": arm_add_request.
std::string plain_name(std::string_view from) {
  std::string name;
  for (const char c : from) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (plain)
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  return name.empty() ? "type" : name;
}

std::string as_typescript(const std::vector<typed_name>& all) {
  std::vector<named_type> named;
  std::vector<typed_topic> topics;
  std::vector<typed_service> services;
  std::deque<std::string> names;
  std::deque<schema_description> apart; // what has no name gets one from each place where it is used
  const auto add = [&](const schema_description* type, const std::string& name) {
    if (type == nullptr) return type;
    if (type->type_name.empty()) type = &apart.emplace_back(*type);
    named.push_back({type, names.emplace_back(plain_name(name))});
    return type;
  };
  for (const typed_name& one : all) {
    if (one.is_service) {
      services.push_back(
          {one.name, add(one.message, one.name + " request"), add(one.answer, one.name + " answer")});
    } else {
      topics.push_back({one.name, add(one.message, one.name)});
    }
  }
  return typescript(named, topics, services);
}

// {"topics":{NAME:SCHEMA},"services":{NAME:{"request":SCHEMA,"response":SCHEMA}}}; true is the schema of what
// has no type.
std::string as_json_schema(const std::vector<typed_name>& all) {
  const auto schema_of = [](const schema_description* type) {
    return type != nullptr ? json_schema(*type) : std::string{"true"};
  };
  std::string topics;
  std::string services;
  for (const typed_name& one : all) {
    std::string& into = one.is_service ? services : topics;
    into += joined(into.empty() ? "\n" : ",\n", json_string_of(one.name), ":");
    into += one.is_service ? joined("{\"request\":", schema_of(one.message),
                                    ",\n\"response\":", schema_of(one.answer), "}")
                           : schema_of(one.message);
  }
  return joined("{\"topics\":{", topics, "},\n\"services\":{", services, "}}\n");
}

// The endpoint's own, of which ROS does not have all.
bool is_endpoints(std::string_view name) {
  return name.starts_with("/rowe/") || name.starts_with("/rosapi/");
}

// Types that ROS does not have are named on stderr, if the program's; the others are printed.
std::string as_ros(const std::vector<typed_name>& all, const console& to, bool& complete) {
  std::string text;
  const auto add = [&](const typed_name& one, const schema_description* type, std::string_view part) {
    if (type == nullptr) return;
    const ros_text made = ros_message(*type);
    if (!made && is_endpoints(one.name)) return;
    if (!made) {
      to.error(printable(one.name), part, ": ", printable(made.reason));
      complete = false;
      return;
    }
    text += joined(text.empty() ? "" : "\n", "# ", printable(one.name), part,
                   one.type.empty() ? "" : joined(" is ", printable(one.type)), "\n", made.text);
  };
  for (const typed_name& one : all) {
    add(one, one.message, one.is_service ? " request" : "");
    add(one, one.answer, " answer");
  }
  return text;
}

// Types that C does not have are named on stderr, if the program's; the others are printed.
std::string as_c(const std::vector<typed_name>& all, const console& to, bool& complete) {
  std::vector<named_type> named;
  std::deque<std::string> names;
  const auto add = [&](const typed_name& one, const schema_description* type, std::string_view part) {
    if (type == nullptr) return;
    const c_text made = c_tables({{type, one.name}});
    const bool fits = made.reasons.empty();
    if (fits) named.push_back({type, names.emplace_back(plain_name(joined(one.name, part)))});
    if (fits || is_endpoints(one.name)) return;
    to.error(printable(one.name), part, ": ", printable(made.reasons.front()));
    complete = false;
  };
  for (const typed_name& one : all) {
    add(one, one.message, one.is_service ? " request" : "");
    add(one, one.answer, " answer");
  }
  return c_tables(named).text;
}

} // namespace

exit_code types(argument_list arguments) {
  types_settings chosen;
  if (const auto end = read(types_table(chosen), arguments)) return *end;
  const console to{"types"};
  if (chosen.ts + chosen.json_schema + chosen.ros + chosen.c > 1)
    return usage_error("types", "--ts, --json-schema, --ros and --c are forms: choose one");
  asked_robot robot{"types", chosen.timeout.value_or(types_timeout), to};
  if (const auto end = robot.connect(chosen.at)) return *end;
  robot_types reads;
  if (!reads.read_all(robot.services())) {
    if (!reads.wrong().empty()) to.error(reads.wrong());
    return reads.end();
  }
  bool complete = true;
  emit(chosen.json_schema ? as_json_schema(reads.found())
       : chosen.ros       ? as_ros(reads.found(), to, complete)
       : chosen.c         ? as_c(reads.found(), to, complete)
                          : as_typescript(reads.found()));
  return complete ? exit_code::done : exit_code::failed;
}

} // namespace rowe::tools
