// SPDX-License-Identifier: Apache-2.0
#include "robot_info.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <rowe/types.hpp>

#include "../interrupt.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_names.hpp"
#include "../network/robot_types.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/amounts.hpp"
#include "../text/colour.hpp"
#include "../text/json_values.hpp"
#include "../text/page.hpp"
#include "../text/times.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration info_timeout = 2s;
constexpr std::size_t info_label_columns = 14;

// What is known of one name.
struct named_thing {
  name_kind kind{};
  std::string name;
  std::string type;
  std::vector<std::pair<std::string_view, std::vector<std::string>>>
      holders;                                 // publishers, subscribers, providers
  std::string figures{};                       // of a topic, while somebody subscribes: in JSON
  const schema_description* message = nullptr; // of a service: what it is asked
  const schema_description* answer = nullptr;
};

class robot_info {
 public:
  robot_info(const robot_info_options& chosen, const console& to)
      : chosen_{chosen}, to_{to}, robot_{"info", chosen.timeout.value_or(info_timeout), to} {}

  exit_code run() {
    if (const auto end = robot_.connect(chosen_.at)) return *end;
    for (const name_kind which : {name_kind::topic, name_kind::service, name_kind::action}) {
      auto all = names_of(robot_.services(), which);
      const bool ends = which == name_kind::topic || robot_.services().end() == exit_code::interrupted;
      if (!all && ends) return robot_.give_up("what it has");
      if (all) names_[static_cast<std::size_t>(which)] = std::move(*all);
    }
    types_known_ = types_.read_all(robot_.services());
    bool complete = true;
    bool first = true;
    for (const std::string& word : chosen_.names) {
      const auto things = find(word);
      if (interrupt::seen()) return exit_code::interrupted;
      complete = complete && !things.empty();
      for (const named_thing& one : things) {
        if (!emit(chosen_.json ? json_of(one) : (first ? "" : "\n") + text_of(one))) return exit_code::done;
        first = false;
      }
    }
    return complete ? exit_code::done : exit_code::failed;
  }

 private:
  // A topic and a service may have the same name. None: that was said.
  std::vector<named_thing> find(const std::string& word) {
    const std::string wanted = word.starts_with('/') ? word : "/" + word;
    std::vector<named_thing> found;
    std::vector<robot_name> known;
    for (const name_kind which : {name_kind::topic, name_kind::service, name_kind::action}) {
      const auto& all = names_[static_cast<std::size_t>(which)];
      known.insert(known.end(), all.begin(), all.end());
      const auto its = std::ranges::find(all, wanted, &robot_name::name);
      if (its != all.end()) found.push_back(about(which, *its));
    }
    if (!found.empty()) return found;
    to_.error("there is no topic, service or action ", quoted(wanted), " at ", robot_.url(),
              did_you_mean(nearest_name(wanted, known)));
    return {};
  }

  named_thing about(name_kind which, const robot_name& its) {
    named_thing one{.kind = which, .name = its.name, .type = its.type, .holders = {}};
    const auto add = [&](std::string_view label, std::string_view service, std::string_view key,
                         std::string_view list) {
      if (auto who = holders_of(robot_.services(), service, key, its.name, list))
        one.holders.emplace_back(label, std::move(*who));
    };
    const auto type_by = [&](std::string_view service, std::string_view key) {
      const auto said = robot_.ask(service, joined("{\"", key, "\":", json_string_of(its.name), "}"));
      if (said) one.type = plain_text_of(read_json(*said).find("type").value_or(json_value{}));
    };
    switch (which) {
    case name_kind::topic:
      if (one.type.empty()) type_by("/rosapi/topic_type", "topic");
      add("publishers", "/rosapi/publishers", "topic", "publishers");
      add("subscribers", "/rosapi/subscribers", "topic", "subscribers");
      one.figures = figures_of(its.name);
      break;
    case name_kind::service:
      type_by("/rosapi/service_type", "service");
      add("providers", "/rosapi/service_providers", "service", "providers");
      break;
    case name_kind::action: type_by("/rosapi/action_type", "action"); break;
    case name_kind::parameter: break; // `rowe param` is for those
    }
    if (!types_known_) return one;
    for (const typed_name& typed : types_.found()) {
      if (typed.name != its.name || typed.is_service != (which == name_kind::service)) continue;
      one.message = typed.message;
      one.answer = typed.answer;
    }
    return one;
  }

  // The row of the topic in the statistics.
  std::string figures_of(const std::string& name) {
    if (!stats_) stats_ = robot_.ask("/rowe/stats").value_or("{}");
    const json_value rows = read_json(*stats_).find("topics").value_or(json_value{});
    for (const json_value row : rows.elements())
      if (plain_text_of(row.find("topic").value_or(json_value{})) == name) return std::string{row.text()};
    return {};
  }

  static std::string type_text(const schema_description* type) {
    const ros_text made = ros_message(*type);
    if (made) return made.text;
    const std::array<named_type, 1> one{{{type, "message"}}};
    return typescript(one);
  }

  static std::string text_of(const named_thing& one) {
    const std::size_t width = columns_of_stdout();
    const auto line = [&](std::string_view label, std::string_view value) {
      return wrapped(joined("  ", label, std::string(info_label_columns - label.size() - 2, ' ')), value,
                     width != 0 && width < 60 ? 4 : info_label_columns, width);
    };
    std::string text = joined(colour::heading(printable(one.name)), " (", word_of(one.kind), ")\n");
    text += line("type", one.type.empty() ? "-" : printable(one.type));
    for (const auto& [label, who] : one.holders) {
      std::string names;
      for (const std::string& each : who) names += joined(names.empty() ? "" : ", ", printable(each));
      text += line(label, who.empty() ? "none" : names);
    }
    const json_value row = read_json(one.figures);
    const auto number = [&](std::string_view member) {
      const auto value = row.get<double>(member);
      return value ? *value : 0.0;
    };
    if (number("subscribers") > 0 || number("rate_hz") > 0) {
      text += line("rate", joined(decimal_text(number("rate_hz"), 1), " Hz, longest gap ",
                                  decimal_text(number("gap_ms_max"), 1), " ms"));
      text += line("size", joined(bytes_text(whole_of(number("bytes"))), " a message"));
    } else if (one.kind == name_kind::topic) {
      text += line("rate", "not known while nobody subscribes; `rowe hz` does");
    }
    const auto type = [&](std::string_view label, const schema_description* its) {
      if (its == nullptr) return;
      text += joined("\n", colour::heading(label), "\n");
      const std::string declared = type_text(its);
      for (std::string_view rest = declared; !rest.empty();) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        const std::string_view declared_line = rest.substr(0, end);
        const bool is_rule =
            declared_line.find_first_not_of('=') == declared_line.npos; // between the types of ROS text
        text += is_rule ? std::string{"\n"} : joined("  ", printable(declared_line), "\n");
        rest.remove_prefix(std::min(end + 1, rest.size()));
      }
    };
    type(one.kind == name_kind::service ? "request" : "message", one.message);
    type("answer", one.answer);
    return text;
  }

  static std::string json_of(const named_thing& one) {
    std::string text = joined("{\"kind\":\"", word_of(one.kind), R"(","name":)", json_string_of(one.name),
                              R"(,"type":)", one.type.empty() ? "null" : json_string_of(one.type));
    for (const auto& [label, who] : one.holders) {
      std::string names;
      for (const std::string& each : who) names += joined(names.empty() ? "" : ",", json_string_of(each));
      text += joined(",\"", label, "\":[", names, "]");
    }
    if (!one.figures.empty()) text += joined(R"(,"figures":)", one.figures);
    if (one.message != nullptr)
      text += joined(one.kind == name_kind::service ? R"(,"request":)" : R"(,"message":)",
                     json_schema(*one.message));
    if (one.answer != nullptr) text += joined(R"(,"answer":)", json_schema(*one.answer));
    text += "}";
    std::ranges::replace(text, '\n', ' ');
    return text + "\n";
  }

  const robot_info_options& chosen_;
  const console& to_;
  asked_robot robot_;
  std::array<std::vector<robot_name>, 3> names_{};
  robot_types types_;
  bool types_known_ = false;
  std::optional<std::string> stats_{};
};

} // namespace

exit_code info_of_robot(const robot_info_options& chosen, const console& to) {
  return robot_info{chosen, to}.run();
}

} // namespace rowe::tools
