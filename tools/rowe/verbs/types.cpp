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
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../output.hpp"
#include "../text/c_tables.hpp"
#include "../text/described_types.hpp"
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

// What one topic or service is called, and its types; null: the program has JSON text there.
struct typed_name {
  std::string name;
  std::string type; // that the endpoint says of it; may be empty
  bool is_service = false;
  const schema_description* message = nullptr; // of a service: what it is asked
  const schema_description* answer = nullptr;
};

class types_reader {
 public:
  types_reader(endpoint& hub, remote& connection, rt::duration timeout, const console& to)
      : hub_{hub}, waits_{connection}, timeout_{timeout}, to_{to} {}

  // False, and the reason was printed.
  bool read_all() {
    auto opened = hub_.client<json_text, json_text>(
        "/rowe/types", {.depth = 1, .text_bytes_max = limits{}.message_bytes_max});
    if (!opened) {
      to_.error("cannot ask: ", opened.error().message());
      return false;
    }
    for (std::uint64_t from = 0;;) {
      const auto answer = waits_.during(
          [&] { return opened->call(joined(R"({"from":)", std::to_string(from), "}"), timeout_); });
      if (!answer) return fail(answer.error(), opened->refusal());
      const json_value page = read_json(answer->value());
      if (!read_page(page)) return false;
      const auto next = page.get<std::uint64_t>("next");
      if (!next) return true;
      if (*next <= from) {
        to_.error("the answer's page ends where it begins");
        return false;
      }
      from = *next;
    }
  }
  const std::vector<typed_name>& found() const noexcept { return found_; }
  exit_code end() const noexcept { return end_; }

 private:
  bool fail(const error& why, std::string_view refusal) {
    end_ = why.code == errc::timed_out ? exit_code::timed_out : exit_code::failed;
    if (interrupt::seen())
      end_ = exit_code::interrupted;
    else if (why.code == errc::refused)
      to_.error(printable(refusal));
    else
      to_.error(why.code == errc::no_service ? std::string{"it does not say its types"} : why.message());
    return false;
  }
  bool read_page(json_value page) {
    const auto list = page.find("types");
    if (!list) {
      to_.error("the answer has no member `types`");
      return false;
    }
    for (const json_value one : list->elements()) {
      const auto topic = one.get<std::string>("topic");
      const auto service = one.get<std::string>("service");
      const auto said = one.get<std::string>("type");
      if (!topic && !service) continue;
      typed_name its{.name = service ? *service : *topic,
                     .type = said ? *said : std::string{},
                     .is_service = service.has_value()};
      if (!read_type(one, service ? "request" : "message", its.name, its.message) ||
          !read_type(one, "answer", its.name, its.answer))
        return false;
      // Several handles of one name say the same.
      const auto same = [&](const typed_name& known) {
        return known.is_service == its.is_service && known.name == its.name;
      };
      if (std::ranges::none_of(found_, same)) found_.push_back(std::move(its));
    }
    return true;
  }
  bool read_type(json_value from, std::string_view member, const std::string& name,
                 const schema_description*& into) {
    const auto its = from.find(member);
    if (!its) return true;
    into = types_.read(*its);
    if (into == nullptr) to_.error("cannot read the type of ", printable(name), ": ", types_.wrong());
    return into != nullptr;
  }

  endpoint& hub_;
  watcher waits_;
  rt::duration timeout_;
  const console& to_;
  described_types types_;
  std::vector<typed_name> found_;
  exit_code end_ = exit_code::failed;
};

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

exit_code types_from(endpoint hub, const std::string& url, const types_settings& o, const console& to) {
  const rt::duration timeout = o.timeout.value_or(types_timeout);
  remote connection{hub, url, to};
  if (const auto end = connection.wait(timeout)) return *end;
  types_reader reads{hub, connection, timeout, to};
  if (!reads.read_all()) return reads.end();
  bool complete = true;
  emit(o.json_schema ? as_json_schema(reads.found())
       : o.ros       ? as_ros(reads.found(), to, complete)
       : o.c         ? as_c(reads.found(), to, complete)
                     : as_typescript(reads.found()));
  return complete ? exit_code::done : exit_code::failed;
}

} // namespace

exit_code types(argument_list arguments) {
  types_settings chosen;
  if (const auto end = read(types_table(chosen), arguments)) return *end;
  const console to{"types"};
  if (chosen.ts + chosen.json_schema + chosen.ros + chosen.c > 1)
    return usage_error("types", "--ts, --json-schema, --ros and --c are forms: choose one");
  const spelled_url url = read_url(chosen.at.url);
  if (url.url.empty()) return usage_error("types", url.wrong);
  const auto bounds = limits_for("types");
  if (!bounds) return exit_code::usage;
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(chosen.at, options, to)) return *end;
  auto hub = endpoint::connect(url.url, options);
  if (!hub) return cannot_open(url.url, hub.error(), to);
  return types_from(std::move(hub).value(), url.url, chosen, to);
}

} // namespace rowe::tools
