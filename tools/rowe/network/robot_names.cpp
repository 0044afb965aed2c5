// SPDX-License-Identifier: Apache-2.0
#include "robot_names.hpp"

#include <algorithm>
#include <array>

#include "../arguments/command_line.hpp"
#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {

struct listing_service {
  std::string_view word;    // of what it lists
  std::string_view service; // which does
  std::string_view list;    // the answer's member
  std::string_view of_type; // the service that says a type; empty: the list has them
};
constexpr std::array<listing_service, 4> listing_services{{
    {"topic", "/rosapi/topics", "topics", ""},
    {"service", "/rosapi/services", "services", "/rosapi/service_type"},
    {"action", "/rosapi/action_servers", "action_servers", "/rosapi/action_type"},
    {"parameter", "/rosapi/get_param_names", "names", ""},
}};

std::vector<std::string> texts_in(json_value answer, std::string_view member) {
  std::vector<std::string> texts;
  const json_value list = answer.find(member).value_or(json_value{});
  for (const json_value one : list.elements()) texts.push_back(plain_text_of(one));
  return texts;
}

} // namespace

std::string_view word_of(name_kind which) noexcept {
  return listing_services[static_cast<std::size_t>(which)].word;
}

bool is_endpoints_own(std::string_view name) noexcept {
  return name.starts_with("/rowe/") || name.starts_with("/rosapi/");
}

std::optional<std::vector<robot_name>> names_of(service_asker& robot, name_kind which,
                                                std::uint64_t* left_out) {
  const listing_service& by = listing_services[static_cast<std::size_t>(which)];
  const auto answer = robot.ask(by.service);
  if (!answer) return std::nullopt;
  const json_value said = read_json(*answer);
  const std::vector<std::string> names = texts_in(said, by.list);
  std::vector<std::string> types = texts_in(said, "types");
  types.resize(names.size());
  if (left_out != nullptr) {
    const auto count = said.get<std::uint64_t>("left_out");
    *left_out = count ? *count : 0;
  }
  std::vector<robot_name> all;
  for (std::size_t i = 0; i < names.size(); ++i) all.push_back({names[i], types[i]});
  std::ranges::sort(all, {}, &robot_name::name);
  return all;
}

bool ask_types(service_asker& robot, name_kind which, std::vector<robot_name>& of) {
  const listing_service& by = listing_services[static_cast<std::size_t>(which)];
  if (by.of_type.empty()) return true;
  for (robot_name& one : of) {
    const auto type = robot.ask(by.of_type, joined("{\"", by.word, "\":", json_string_of(one.name), "}"));
    if (!type && robot.end() == exit_code::interrupted) return false;
    if (!type && robot.end() == exit_code::timed_out) break; // nor will it say the others
    if (type) one.type = plain_text_of(read_json(*type).find("type").value_or(json_value{}));
  }
  return true;
}

std::optional<std::vector<std::string>> holders_of(service_asker& robot, std::string_view service,
                                                   std::string_view key, std::string_view name,
                                                   std::string_view list) {
  const auto answer = robot.ask(service, joined("{\"", key, "\":", json_string_of(name), "}"));
  if (!answer) return std::nullopt;
  return texts_in(read_json(*answer), list);
}

std::string with_slash(std::string_view name) {
  return name.starts_with('/') ? std::string{name} : joined("/", name);
}

std::string nearest_name(std::string_view name, const std::vector<robot_name>& all) {
  std::vector<std::string_view> known;
  for (const robot_name& one : all) known.push_back(one.name);
  const std::string whole = with_slash(name);
  if (std::ranges::find(known, whole) != known.end()) return whole;
  // The last part alone: "odom" for "/robot/odom".
  for (const std::string_view one : known)
    if (one.ends_with(whole)) return std::string{one};
  return std::string{nearest(whole, known)};
}

} // namespace rowe::tools
