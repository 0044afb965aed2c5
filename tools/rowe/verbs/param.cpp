// SPDX-License-Identifier: Apache-2.0
// rowe param: lists, reads and sets the parameters of a robot, by the services of ROS.
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../arguments/values.hpp"
#include "../console.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_names.hpp"
#include "../output.hpp"
#include "../text/json_values.hpp"
#include "../text/message_format.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration param_timeout = 2s;

struct param_settings {
  std::string what;
  remote_place at;
  std::string name;
  std::string value;
  std::optional<rt::duration> timeout;
  bool all = false;
  bool json = false;
};

command param_table(param_settings& o) {
  return {
      .verb = "param",
      .examples = {{{"rowe param list ws://127.0.0.1:8080", "the robot's parameters and their values"},
                    {"rowe param set 127.0.0.1:8080 /gain 0.5", "sets it"}}},
      .description = "Lists, reads or sets parameters. A VALUE that is no JSON is a text. A "
                     "value outside of the\n"
                     "parameter's range, or one that your role may not set, is refused, and the reason "
                     "is on stderr (1).\n"
                     "The endpoint's own limits and counters are parameters too, read only.\n",
      .operands =
          {{.name = "list|get|set", .meaning = "what to do", .into = &o.what},
           url_operand(o.at.url),
           {.name = "NAME", .meaning = "get, set: the parameter's name", .into = &o.name, .optional = true},
           {.name = "VALUE", .meaning = "set: the value, in JSON", .into = &o.value, .optional = true}},
      .options = with_remote(
          o.at, {
                    {"--timeout", "", "TIME", "for the connection and for each answer (default 2s)",
                     time_span{&o.timeout}},
                    {"--json", "", "", R"(list, get: {"name":..,"value":..}, one a line)", &o.json},
                    {"--all", "", "", "list: also the endpoint's own, below /rowe/", &o.all},
                })};
}

// As endpoints say it of names; `which` is a name or a value.
std::string utf8_fault(std::string_view which, std::string_view text) {
  const auto at = not_utf8_at(text);
  return at ? joined("the argument ", which, " is not UTF-8 (at byte ", *at, ")") : std::string{};
}

// What is wrong with the arguments together; empty when nothing is.
std::string param_fault(const param_settings& o) {
  if (o.what != "list" && o.what != "get" && o.what != "set")
    return joined("the first word is list, get or set, not ", quoted(o.what));
  if (o.what == "list") return o.name.empty() ? "" : "list takes no NAME";
  if (o.name.empty()) return joined(o.what, " needs the NAME of a parameter");
  if (std::string wrong = utf8_fault("name", o.name); !wrong.empty()) return wrong;
  if (o.what == "get") return o.value.empty() ? "" : "get takes no VALUE";
  return o.value.empty() ? "set needs a VALUE" : utf8_fault("value", o.value);
}

std::string reason_of(const json_value& answer) {
  auto said = answer.get<std::string>("reason");
  return said ? std::move(*said) : std::string{"it was refused, without a reason"};
}

class param_asker {
 public:
  param_asker(asked_robot& robot, const console& to) : robot_{robot}, to_{to} {}

  // The answer; nothing, and the reason was printed. `about`: the parameter, if it is of one.
  std::optional<std::string> ask(std::string_view service, const std::string& what,
                                 std::string_view about = {}) {
    auto answer = robot_.ask(service, what);
    end_ = robot_.services().end();
    if (answer) return answer;
    if (const std::string why = robot_.services().why(); !why.empty()) to_.error(why, hint(about));
    return std::nullopt;
  }
  // All there are, sorted; nothing, and the reason was printed.
  std::optional<std::vector<robot_name>> names() {
    auto all = names_of(robot_.services(), name_kind::parameter);
    end_ = robot_.services().end();
    if (!all && !robot_.services().why().empty()) to_.error(robot_.services().why());
    return all;
  }
  // The value in JSON.
  std::optional<std::string> get(const std::string& name) {
    const auto answer = ask("/rosapi/get_param", joined(R"({"name":)", json_string_of(name), "}"), name);
    if (!answer) return std::nullopt;
    const json_value read = read_json(*answer);
    if (const auto known = read.get<bool>("successful"); known && !*known) {
      to_.error(printable(reason_of(read)), hint(name));
      return std::nullopt;
    }
    const auto value = read.get<std::string>("value");
    if (value) return *value;
    to_.error("the answer has no value: ", printable(*answer));
    return std::nullopt;
  }
  exit_code end() const noexcept { return end_; }

 private:
  // Which parameter may have been meant in place of one that there is not.
  std::string hint(std::string_view name) {
    if (name.empty()) return {};
    const auto all = names_of(robot_.services(), name_kind::parameter);
    if (!all) return {};
    const std::string meant = nearest_name(name, *all);
    return meant == name ? std::string{} : did_you_mean(meant);
  }

  asked_robot& robot_;
  const console& to_;
  exit_code end_ = exit_code::failed;
};

std::string json_of(const std::string& name, const std::string& value) {
  return on_one_line(
      joined(R"({"name":)", json_string_of(name), R"(,"value":)", read_json(value).text(), "}"));
}

exit_code list_params(param_asker& asks, const param_settings& o) {
  const auto names = asks.names();
  if (!names) return asks.end();
  for (const auto& [name, type] : *names) {
    if (!o.all && name.starts_with("/rowe/")) continue;
    const auto value = asks.get(name);
    if (!value) return asks.end();
    const bool read =
        emit(o.json ? json_of(name, *value) : joined(printable(name), " ", printable(*value), "\n"));
    if (!read) break;
  }
  return exit_code::done;
}

exit_code set_param(param_asker& asks, const param_settings& o) {
  const std::string what =
      joined(R"({"name":)", json_string_of(o.name), R"(,"value":)", json_string_of(o.value), "}");
  const auto answer = asks.ask("/rosapi/set_param", what, o.name);
  if (!answer) return asks.end();
  // Servers of ROS 2 say so in the answer.
  const json_value read = read_json(*answer);
  if (const auto well = read.get<bool>("successful"); !well || *well) return exit_code::done;
  console{"param"}.error(printable(reason_of(read)));
  return exit_code::failed;
}

} // namespace

exit_code param(argument_list arguments) {
  param_settings chosen;
  if (const auto end = read(param_table(chosen), arguments)) return *end;
  const console to{"param"};
  if (const std::string wrong = param_fault(chosen); !wrong.empty()) return usage_error("param", wrong);
  asked_robot robot{"param", chosen.timeout.value_or(param_timeout), to};
  if (const auto end = robot.connect(chosen.at)) return *end;
  param_asker asks{robot, to};
  if (chosen.what == "list") return list_params(asks, chosen);
  if (chosen.what == "set") return set_param(asks, chosen);
  const auto value = asks.get(chosen.name);
  if (!value) return asks.end();
  emit(chosen.json ? json_of(chosen.name, *value) : joined(printable(*value), "\n"));
  return exit_code::done;
}

} // namespace rowe::tools
