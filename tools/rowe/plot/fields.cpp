// SPDX-License-Identifier: Apache-2.0
#include "fields.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t listed_max = 8;

std::string_view without_first_slash(std::string_view name) noexcept {
  return name.starts_with('/') ? name.substr(1) : name;
}

// Where a name in brackets ends that begins at `at`: commas and points inside of its quotes are its own.
std::size_t end_of_brackets(std::string_view text, std::size_t at) noexcept {
  const char quote = at + 1 < text.size() ? text[at + 1] : ']';
  const bool is_quoted = quote == '\'' || quote == '"';
  const std::size_t from = is_quoted ? text.find(quote, at + 2) : at;
  return std::min(from == text.npos ? from : text.find(']', from), text.size());
}

std::vector<std::string> split_paths(std::string_view text) {
  std::vector<std::string> all(1);
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == ',') {
      all.emplace_back();
    } else if (text[at] == '[') {
      const std::size_t end = end_of_brackets(text, at);
      all.back() += text.substr(at, end - at + 1);
      at = end;
    } else {
      all.back() += text[at];
    }
  }
  return all;
}

// The topic and paths of one option. Nothing: `wrong` says what is.
struct topic_and_paths {
  std::string topic;
  std::vector<std::string> paths;
};
std::optional<topic_and_paths> read_wish(std::string_view option, const std::string& text,
                                         std::string& wrong) {
  const std::size_t colon = text.find(':');
  if (colon == text.npos || colon == 0 || colon + 1 == text.size()) {
    wrong = joined(option, " needs a topic and a field, such as /odom:pose.x, not ", quoted(text));
    return std::nullopt;
  }
  topic_and_paths read{joined("/", without_first_slash(text.substr(0, colon))),
                       split_paths(std::string_view{text}.substr(colon + 1))};
  for (const std::string& path : read.paths) {
    const auto probe = json_value{}.get<json_value>(path);
    const bool is_wrong = !probe && probe.code() == errc::bad_argument;
    if (!path.empty() && !is_wrong) continue;
    wrong = joined(option, " ", quoted(text), ": ",
                   path.empty() ? "a field has no name" : printable(probe.error().message()));
    return std::nullopt;
  }
  return read;
}

struct path_step {
  std::string name; // of a member; empty: an item of an array
};
// Of a path that json_value takes.
std::vector<path_step> steps_in(std::string_view path) {
  std::vector<path_step> steps;
  std::string name;
  const auto end_name = [&] {
    if (!name.empty()) steps.push_back({std::exchange(name, {})});
  };
  for (std::size_t at = 0; at < path.size(); ++at) {
    if (path[at] == '.') {
      end_name();
    } else if (path[at] == '[') {
      end_name();
      const std::size_t end = end_of_brackets(path, at);
      const std::string_view inside = path.substr(at + 1, end - at - 1);
      const bool is_name = inside.size() > 2 && (inside.front() == '\'' || inside.front() == '"');
      steps.push_back({std::string{is_name ? inside.substr(1, inside.size() - 2) : std::string_view{}}});
      at = end;
    } else {
      name += path[at];
    }
  }
  end_name();
  return steps;
}

std::optional<json_value> member_of(json_value object, std::string_view name) {
  for (const auto [its, value] : object.members()) {
    if (its.says(name)) return value;
  }
  return std::nullopt;
}

// A schema that allows null says so by a choice; the other one is meant.
json_value without_null(json_value schema) {
  const auto choices = schema.find("anyOf");
  if (!choices) return schema;
  for (const json_value one : choices->elements()) {
    const auto type = one.find("type");
    if (!type || !type->says("null")) return one;
  }
  return schema;
}

// How rowe's own schemas say the units of times.
std::string short_unit(std::string_view said) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> units{{{"seconds", "s"},
                                                                                {"milliseconds", "ms"},
                                                                                {"microseconds", "µs"},
                                                                                {"nanoseconds", "ns"},
                                                                                {"minutes", "min"},
                                                                                {"hours", "h"},
                                                                                {"days", "d"}}};
  constexpr std::string_view since = " since 1970";
  if (said.ends_with(since)) said.remove_suffix(since.size());
  const auto* const found =
      std::ranges::find(units, said, &std::pair<std::string_view, std::string_view>::first);
  return found == units.end() ? std::string{} : std::string{found->second};
}

} // namespace

std::optional<std::vector<field_wish>> fields_of(const std::vector<std::string>& given, std::string& wrong) {
  std::vector<field_wish> all;
  std::size_t lane = 0;
  for (const std::string& text : given) {
    auto read = read_wish("--field", text, wrong);
    if (!read) return std::nullopt;
    const std::size_t before = all.size();
    for (std::string& path : read->paths) {
      const bool is_known = std::ranges::any_of(
          all, [&](const field_wish& one) { return one.topic == read->topic && one.path == path; });
      if (!is_known) all.push_back({.topic = read->topic, .path = std::move(path), .lane = lane});
    }
    if (all.size() > before) ++lane;
  }
  return all;
}

std::optional<std::vector<field_wish>> paths_of(const std::vector<std::string>& given, std::string& wrong) {
  std::vector<field_wish> all;
  for (const std::string& text : given) {
    auto read = read_wish("--xy", text, wrong);
    if (!read) return std::nullopt;
    if (read->paths.size() != 2) {
      wrong = joined("--xy needs two fields of a topic, such as /odom:pose.x,pose.y, not ", quoted(text));
      return std::nullopt;
    }
    all.push_back({.topic = read->topic, .path = read->paths[1], .x_path = read->paths[0]});
  }
  return all;
}

bool is_same_name(std::string_view one, std::string_view other) noexcept {
  return without_first_slash(one) == without_first_slash(other);
}

std::string hint_of(std::string_view word, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  const std::vector<std::string_view> views{known.begin(), known.end()};
  if (const std::string_view meant = nearest(word, views); !meant.empty()) return did_you_mean(meant);
  std::string text = "; there is ";
  for (std::size_t i = 0; i < std::min(known.size(), listed_max); ++i)
    text.append(i == 0 ? "" : ", ").append(printable(known[i]));
  return text.append(known.size() > listed_max ? joined(" and ", known.size() - listed_max, " more") : "");
}

std::string hint_of_path(std::string_view path, json_value message) {
  std::vector<std::string> numbers;
  for (const json_leaf& one : leaves_of(message)) {
    const json_kind kind = one.value.kind();
    if (kind == json_kind::number || kind == json_kind::boolean) numbers.push_back(one.path);
  }
  // "x" where there is "pose.x", and "pose" where there are "pose.x" and "pose.y".
  std::vector<std::string> around;
  for (const std::string& one : numbers) {
    const bool is_behind = one.ends_with(joined(".", path));
    const bool is_inside = one.starts_with(joined(path, ".")) || one.starts_with(joined(path, "["));
    if (is_behind || is_inside) around.push_back(one);
  }
  if (around.size() == 1) return did_you_mean(around.front());
  if (!around.empty()) return hint_of({}, around);
  return numbers.empty() ? "; it has no numbers" : hint_of(path, numbers);
}

std::string unit_in(std::string_view json_schema, std::string_view path) {
  if (json_schema.empty()) return {};
  json_value at = without_null(read_json(json_schema));
  for (const path_step& step : steps_in(path)) {
    std::optional<json_value> next;
    if (step.name.empty()) {
      next = at.find("items");
    } else if (const auto properties = at.find("properties")) {
      next = member_of(*properties, step.name);
    }
    if (!next) return {};
    at = without_null(*next);
  }
  if (const auto unit = at.get<std::string>("unit")) return *unit;
  const auto description = at.get<std::string>("description");
  return description ? short_unit(*description) : std::string{};
}

} // namespace rowe::tools
