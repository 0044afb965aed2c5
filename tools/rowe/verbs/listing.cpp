// SPDX-License-Identifier: Apache-2.0
// rowe topics, services, actions and list: what a robot has, by name.
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_names.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/colour.hpp"
#include "../text/json_values.hpp"
#include "../text/page.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration listing_timeout = 2s;

struct listing_options {
  remote_place at;
  std::optional<rt::duration> timeout;
  bool all = false;
  bool json = false;
  bool quiet = false;
};

command listing_table(listing_options& o, std::string_view verb, std::array<example, 2> examples,
                      std::string_view description) {
  return {
      .verb = verb,
      .examples = examples,
      .description = description,
      .operands = {url_operand(o.at.url)},
      .options = with_remote(
          o.at, {{"--all", "", "", "also those that every endpoint has, below /rowe/ and /rosapi/", &o.all},
                 {"--json", "", "", "one JSON object", &o.json},
                 {"--timeout", "", "TIME", "for the connection and for each answer (default 2s)",
                  time_span{&o.timeout}},
                 {"--quiet", "-q", "", "print errors only on stderr", &o.quiet}})};
}

struct listed {
  std::vector<robot_name> shown;
  std::size_t hidden = 0; // of the endpoint's own
  std::uint64_t left_out = 0;
};

// Nothing: the robot does not say.
std::optional<listed> names_to_show(asked_robot& robot, name_kind which, const listing_options& o) {
  listed found;
  auto all = names_of(robot.services(), which, &found.left_out);
  if (!all) return std::nullopt;
  for (robot_name& one : *all) {
    if (!o.all && is_endpoints_own(one.name))
      ++found.hidden;
    else
      found.shown.push_back(std::move(one));
  }
  if (!ask_types(robot.services(), which, found.shown)) return std::nullopt;
  return found;
}

std::string listing_json(const std::vector<robot_name>& names) {
  std::string text;
  for (const robot_name& one : names)
    text += joined(text.empty() ? "" : ",", R"({"name":)", json_string_of(one.name), R"(,"type":)",
                   one.type.empty() ? "null" : json_string_of(one.type), "}");
  return joined("[", text, "]");
}

std::string listing_text(const listed& names, name_kind which) {
  constexpr std::array<std::string_view, 3> headings{"TOPIC", "SERVICE", "ACTION"};
  const std::string_view heading = headings[static_cast<std::size_t>(which)];
  text_table table{{{heading}, {.heading = "TYPE", .if_any = true}}};
  for (const robot_name& one : names.shown)
    table.add({printable(one.name), one.type.empty() ? "-" : printable(one.type)});
  return table.empty() ? std::string{} : table.text(columns_of_stdout());
}

void note_the_rest(const listed& names, name_kind which, const console& to) {
  const std::string_view word = word_of(which);
  if (names.hidden != 0)
    to.note(counted(names.hidden, word), names.hidden == 1 ? " is" : " are", " the endpoint's own (--all)");
  if (names.left_out != 0) to.note(counted(names.left_out, word), " more had no room in the answer");
}

exit_code list_one(argument_list arguments, name_kind which, const command& table, listing_options& o) {
  if (const auto end = read(table, arguments)) return *end;
  console to{table.verb};
  to.be_quiet(o.quiet);
  asked_robot robot{table.verb, o.timeout.value_or(listing_timeout), to};
  if (const auto end = robot.connect(o.at)) return *end;
  const auto found = names_to_show(robot, which, o);
  if (!found) return robot.give_up(joined("what ", word_of(which), "s it has"));
  emit(o.json ? joined("{\"", word_of(which), "s\":", listing_json(found->shown), "}\n")
              : listing_text(*found, which));
  if (found->shown.empty()) to.note("it has no ", word_of(which), "s", o.all ? "" : " of its program");
  note_the_rest(*found, which, to);
  return exit_code::done;
}

} // namespace

exit_code topics(argument_list arguments) {
  listing_options chosen;
  return list_one(
      arguments, name_kind::topic,
      listing_table(chosen, "topics",
                    {{{"rowe topics ws://127.0.0.1:8080", "names and types"},
                      {"rowe topics 127.0.0.1:8080 --json | jq -r '.topics[].name'", "in a script"}}},
                    "Lists the topics that somebody publishes or subscribes to at a robot, with "
                    "their\ntypes. `rowe info URL TOPIC` says who.\n"),
      chosen);
}

exit_code services(argument_list arguments) {
  listing_options chosen;
  return list_one(
      arguments, name_kind::service,
      listing_table(chosen, "services",
                    {{{"rowe services ws://127.0.0.1:8080", "those of the robot's program"},
                      {"rowe services 127.0.0.1:8080 --all", "and those of every endpoint"}}},
                    "Lists the services that a robot provides, with their types. `rowe call` calls "
                    "one.\n"),
      chosen);
}

exit_code actions(argument_list arguments) {
  listing_options chosen;
  return list_one(
      arguments, name_kind::action,
      listing_table(chosen, "actions",
                    {{{"rowe actions ws://127.0.0.1:8080", "names and types"},
                      {"rowe actions 127.0.0.1:8080 --json", "for programs"}}},
                    "Lists the actions that a robot provides, with their types: services that take "
                    "goals,\nand say meanwhile how far they are.\n"),
      chosen);
}

exit_code list(argument_list arguments) {
  listing_options chosen;
  const command table = listing_table(
      chosen, "list",
      {{{"rowe list ws://127.0.0.1:8080", "all that a robot has"},
        {"rowe list 127.0.0.1:8080 --json", "one JSON object, with topics, services and actions"}}},
      "Lists the topics, services and actions of a robot, with their types.\n");
  if (const auto end = read(table, arguments)) return *end;
  console to{"list"};
  to.be_quiet(chosen.quiet);
  asked_robot robot{"list", chosen.timeout.value_or(listing_timeout), to};
  if (const auto end = robot.connect(chosen.at)) return *end;
  std::string text;
  bool any = false; // is in the text
  for (const name_kind which : {name_kind::topic, name_kind::service, name_kind::action}) {
    auto found = names_to_show(robot, which, chosen);
    // Servers that are none of ours may know no actions.
    if (!found && (!robot.services().has_no_such() || which == name_kind::topic))
      return robot.give_up(joined("what ", word_of(which), "s it has"));
    if (!found) found.emplace();
    if (chosen.json) {
      text += joined(any ? ",\"" : "{\"", word_of(which), "s\":", listing_json(found->shown));
    } else if (!found->shown.empty()) {
      text += joined(any ? "\n" : "", listing_text(*found, which));
    }
    any = any || chosen.json || !found->shown.empty();
    if (!chosen.json) note_the_rest(*found, which, to);
  }
  if (chosen.json) text += "}\n";
  if (!any) to.note("it has nothing but what every endpoint has (--all)");
  emit(text);
  return exit_code::done;
}

} // namespace rowe::tools
