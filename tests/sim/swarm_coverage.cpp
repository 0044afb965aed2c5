// SPDX-License-Identifier: Apache-2.0
#include "swarm_coverage.hpp"

#include <algorithm>
#include <cstdio>

namespace swarm {

const std::array<state_name, states>& state_names() {
  using d = dimension;
  static const std::array<state_name, states> all{{{d::topic, "absent"},
                                                   {d::topic, "strangers"},
                                                   {d::topic, "own"},
                                                   {d::topic, "latched"},
                                                   {d::subscription, "none"},
                                                   {d::subscription, "idle"},
                                                   {d::subscription, "queued"},
                                                   {d::subscription, "throttled"},
                                                   {d::subscription, "backpressured"},
                                                   {d::service, "nobodys"},
                                                   {d::service, "peers"},
                                                   {d::service, "own"},
                                                   {d::service, "endpoints"},
                                                   {d::call, "none"},
                                                   {d::call, "open"},
                                                   {d::call, "same_id"},
                                                   {d::answer, "asked"},
                                                   {d::answer, "over"},
                                                   {d::answer, "foreign"},
                                                   {d::stop, "unused"},
                                                   {d::stop, "stopped"},
                                                   {d::stop, "running"},
                                                   {d::connection, "fresh"},
                                                   {d::connection, "rosbridge"},
                                                   {d::connection, "bare"},
                                                   {d::connection, "backpressured"},
                                                   {d::connection, "closing"}}};
  return all;
}

bool has(std::size_t row, std::size_t column) {
  const auto& of = operations()[rows()[row].operation].of;
  return std::find(of.begin(), of.end(), state_names()[column].of) != of.end();
}

std::string_view impossible(std::size_t row, std::size_t column) {
  const row_name& r = rows()[row];
  const state in{static_cast<std::uint8_t>(column)};
  if (!has(row, column)) return "the operation does not look at it";
  if (r.own) return {};
  const member_rule& m = operations()[r.operation].members[r.member];
  const std::string_view how = classes_of(m.is)[r.value].name;
  const auto is = [&](auto... any) { return ((in == any) || ...); };
  const dimension looks_at = state_names()[column].of;
  if (!classes_of(m.is)[r.value].good && looks_at != dimension::connection)
    return "it is refused before that is looked at";
  if (!classes_of(m.is)[r.value].good && !is(state::connection_rosbridge, state::connection_bare))
    return "a refusal is like others: the operation's own row has it";
  if (m.is != domain::answered_id && is(state::answer_over, state::answer_foreign))
    return "nothing else is looked at then";
  if (in == state::connection_closing) return "nothing of it is read: the operation's own row has it";
  const bool no_name =
      how == "absent" || how == "empty" || how == "no_text" || how == "too_long" || how == "control";
  if (m.is == domain::topic) {
    if (no_name &&
        is(state::topic_strangers, state::topic_own, state::topic_latched, state::subscription_idle,
           state::subscription_queued, state::subscription_throttled, state::subscription_backpressured))
      return "it names no topic";
    const bool endpoints = how == "stats" || how == "stop_state";
    if (endpoints && is(state::topic_absent, state::topic_strangers)) return "the endpoint holds it";
    if (how == "stats" && is(state::topic_latched)) return "the endpoint latches no topic of its own";
    if (how == "stop_state" && is(state::topic_latched)) return "the endpoint latches no topic of its own";
    if (how == "made_up" && is(state::topic_own, state::topic_latched))
      return "no handle of this process has such a name";
    if ((how == "stop" || how == "reserved") && is(state::topic_own, state::topic_latched))
      return "no handle of this process may have such a name";
    if (how == "longest" && is(state::topic_own, state::topic_latched))
      return "no handle of this process has it";
    if (how == "honest" && is(state::topic_latched)) return "its handle is not latched";
    if ((how == "escaped" || how == "no_slash") && is(state::topic_own, state::topic_latched))
      return "it is one of those that only strangers have";
    if (how == "shared" && is(state::topic_own, state::topic_latched)) return "only strangers have it";
    if (how == "own" && is(state::topic_strangers)) return {};
  }
  if (m.is == domain::answered_id) {
    if (how == "asked" && in == state::answer_over) return "it is not answered yet";
    if (how == "answered" && in == state::answer_asked) return "it is answered";
    const bool foreign = how != "asked" && how != "answered";
    if (foreign && is(state::answer_asked, state::answer_over))
      return "it is no id that this peer was asked under";
  }
  if (m.is == domain::id) {
    if ((how == "absent" || how == "null") && in == state::call_same_id) return "it is no id";
    if (how == "again" && in == state::call_open) return "it is that of a call that is open";
  }
  if (m.is == domain::service || m.is == domain::called_service) {
    if (how == "stop" && in == state::service_nobodys) return "it is the endpoint's";
    if ((no_name || how == "nobodys") &&
        is(state::service_peers, state::service_own, state::service_endpoints))
      return "it names no service that there is";
    const bool endpoints = how == "stats" || how == "rosapi";
    if (endpoints && !is(state::service_endpoints) && state_names()[column].of == dimension::service)
      return "it is the endpoint's";
    if (!endpoints && how != "stop" && is(state::service_endpoints)) return "it is not the endpoint's";
    if (how == "stop" && is(state::service_peers, state::service_own)) return "only the endpoint has it";
    if (how == "reserved" && is(state::service_peers, state::service_own, state::service_endpoints))
      return "nobody can have it";
    if ((how == "made_up" || how == "longest") && is(state::service_own))
      return "no handle of this process has it";
    if (how == "honest" && is(state::service_peers)) return "the process wins over strangers";
  }
  return {};
}

std::vector<std::string> coverage::holes() const {
  std::vector<std::string> found;
  for (std::size_t row = 0; row < rows().size(); ++row) {
    for (std::size_t column = 0; column < states; ++column) {
      if (counts_[row * states + column] != 0 || !impossible(row, column).empty()) continue;
      constexpr std::string_view dimensions[] = {"topic",  "subscription", "service",   "call",
                                                 "answer", "stop",         "connection"};
      const state_name& s = state_names()[column];
      found.push_back(text_of(rows()[row]) + " x " + std::string{dimensions[static_cast<std::size_t>(s.of)]} +
                      " " + std::string{s.name});
    }
  }
  return found;
}

std::string coverage::table() const {
  std::string text;
  std::size_t operation = SIZE_MAX;
  for (std::size_t row = 0; row < rows().size(); ++row) {
    const row_name& r = rows()[row];
    std::array<char, 64> cell;
    if (r.operation != operation) {
      operation = r.operation;
      text += '\n';
      std::snprintf(cell.data(), cell.size(), "%-34s", operations()[operation].name.data());
      text += cell.data();
      for (std::size_t column = 0; column < states; ++column) {
        if (!has(row, column)) continue;
        std::snprintf(cell.data(), cell.size(), " %13s", state_names()[column].name.data());
        text += cell.data();
      }
      text += '\n';
    }
    const std::string name =
        r.own ? std::string{"(any)"} : text_of(r).substr(operations()[operation].name.size() + 1);
    std::snprintf(cell.data(), cell.size(), "  %-32s", name.c_str());
    text += cell.data();
    for (std::size_t column = 0; column < states; ++column) {
      if (!has(row, column)) continue;
      const std::uint32_t count = counts_[row * states + column];
      if (count == 0 && !impossible(row, column).empty()) {
        std::snprintf(cell.data(), cell.size(), " %13s", "-");
      } else {
        std::snprintf(cell.data(), cell.size(), " %13u", count);
      }
      text += cell.data();
    }
    text += '\n';
  }
  return text;
}

} // namespace swarm
