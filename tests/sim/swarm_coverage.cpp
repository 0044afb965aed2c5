// SPDX-License-Identifier: Apache-2.0
#include "swarm_coverage.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <utility>

namespace swarm {

const std::vector<state_name>& state_names() {
  using d = dimension;
  static const std::vector<state_name> all = [] {
    std::vector<state_name> made;
    const std::pair<dimension, std::vector<std::string_view>> of_each[] = {
        {d::topic, {"absent", "peers", "own", "latched"}},
        {d::subscription, {"none", "idle", "queued", "throttled", "backpressured"}},
        {d::service, {"nobodys", "peers", "own", "endpoints"}},
        {d::call, {"none", "open", "same_id"}},
        {d::answer, {"asked", "over", "foreign"}},
        {d::stop, {"unused", "stopped", "running"}},
        {d::connection, {"fresh", "rosbridge", "plain", "numbers", "foxglove", "backpressured", "closing"}},
        {d::times, {"once", "burst", "in_turn"}},
        {d::queue, {"takes", "full", "refuses"}},
        {d::inbox, {"empty", "message", "call"}},
        {d::outcome, {"good", "bad", "given_up"}},
        {d::heard, {"nothing", "acknowledged", "reset", "refused", "too_late"}},
    };
    for (const auto& [of, names] : of_each)
      for (const std::string_view name : names) made.push_back({of, name});
    if (made.size() != states) std::abort(); // they are not those of `state`
    return made;
  }();
  return all;
}

bool has(std::size_t row, std::size_t column) {
  const auto& of = operations()[rows()[row].operation].of;
  return std::find(of.begin(), of.end(), state_names()[column].of) != of.end();
}

namespace {

std::string_view impossible_of_thread(const member_rule& m, std::string_view how, state in) {
  const bool refused = in == state::queue_refuses;
  if (m.is == domain::submitted) {
    if (how == "too_large") return refused ? "" : "it is too long";
    if (refused) return "it is not too long";
  }
  if (m.is == domain::args && how != "large" && how != "largest" && refused) return "it is not too long";
  if (m.is == domain::args && how == "largest" && !refused) return "it is too long where limits are usual";
  return {};
}

} // namespace

std::string_view impossible(std::size_t row, std::size_t column) {
  const row_name& r = rows()[row];
  const state in{static_cast<std::uint8_t>(column)};
  if (!has(row, column)) return "the operation does not look at it";
  const operation& of = operations()[r.operation];
  const auto is = [&](auto... any) { return ((in == any) || ...); };
  const dimension looks_at = state_names()[column].of;
  const speaker by = speaker_of(of.goes);
  const auto undone = [&] {
    return std::any_of(std::begin(pairs_of_operations), std::end(pairs_of_operations),
                       [&](const opposites& two) { return of.name == two.takes || of.name == two.gives; });
  };
  if (is(state::times_in_turn) && !undone()) return "nothing undoes it";
  if (by == speaker::numbers_peer && is(state::subscription_queued, state::subscription_throttled))
    return "such a subscription has no options";
  if (is(state::queue_refuses) && of.name == "thread_refusal") return "no diagnostic is so long";
  if (by == speaker::thread && is(state::stop_unused)) return "threads can stop once there is a latch";
  if (r.own) return {};
  const member_rule& m = of.members[r.member];
  const bool good = classes_of(m.is)[r.value].good;
  const std::string_view how = classes_of(m.is)[r.value].name;
  if (looks_at == dimension::times)
    return of.goes == form::opening && is(state::times_once) ? "" : "it is the operation that is repeated";
  if (by == speaker::thread) return impossible_of_thread(m, how, in);
  const bool by_names = is(state::connection_rosbridge, state::connection_plain);
  const bool by_numbers = is(state::connection_numbers, state::connection_foxglove);
  if ((by == speaker::numbers_peer && by_names) || (by == speaker::peer && by_numbers) ||
      (by == speaker::foxglove_peer && (by_names || is(state::connection_numbers))))
    return "another codec has no such operation: the operation's own row has it";
  if (!good && looks_at != dimension::connection) return "it is refused before that is looked at";
  if (!good && !by_names && !by_numbers) return "a refusal is like others: the operation's own row has it";
  if (m.is != domain::answered_id && is(state::answer_over, state::answer_foreign))
    return "nothing else is looked at then";
  if (in == state::connection_closing) return "nothing of it is read: the operation's own row has it";
  const bool no_name =
      how == "absent" || how == "empty" || how == "no_text" || how == "too_long" || how == "control";
  const bool no_number = how == "gone" || how == "never" || how == "zero" || how == "largest";
  if (m.is == domain::channel) {
    if (no_number && (looks_at == dimension::topic || looks_at == dimension::subscription) &&
        !is(state::topic_absent, state::subscription_none))
      return "it names no topic";
    if (how == "endpoints" && is(state::topic_peers, state::topic_latched)) return "the endpoint holds it";
    if (how == "shared" && is(state::topic_own, state::topic_latched)) return "only untrusted peers have it";
    if (how == "honest" && is(state::topic_latched)) return "its handle is not latched";
  }
  if (m.is == domain::called_number) {
    if (no_number && is(state::service_peers, state::service_own, state::service_endpoints))
      return "it names no service";
    if ((how == "stats" || how == "lists") && is(state::service_peers, state::service_own))
      return "it is the endpoint's";
    if ((how == "shared" || how == "honest") && is(state::service_endpoints))
      return "it is not the endpoint's";
    if (how == "honest" && is(state::service_peers)) return "the process wins over untrusted peers";
  }
  if (m.is == domain::body && by == speaker::numbers_peer && is(state::topic_latched))
    return "what is kept is the same in each codec: publish.msg has it";
  if (m.is == domain::own_number && how == "largest" && is(state::topic_latched))
    return "a number that is known is like others: another row has it";
  if (m.is == domain::call_number && how == "again" && in == state::call_open)
    return "it is that of a call that is open";
  if (m.is == domain::topic) {
    if (no_name &&
        is(state::topic_peers, state::topic_own, state::topic_latched, state::subscription_idle,
           state::subscription_queued, state::subscription_throttled, state::subscription_backpressured))
      return "it names no topic";
    const bool endpoints = how == "stats" || how == "stop_state";
    if (endpoints && is(state::topic_absent, state::topic_peers)) return "the endpoint holds it";
    if (endpoints && is(state::topic_latched)) return "the endpoint latches no topic of its own";
    if (how == "honest" && is(state::topic_latched)) return "its handle is not latched";
    if (is(state::topic_own, state::topic_latched)) {
      if (how == "stop" || how == "reserved") return "no handle of this process may have such a name";
      if (how == "made_up" || how == "longest") return "no handle of this process has it";
      if (how == "escaped" || how == "no_slash" || how == "shared") return "only untrusted peers have it";
    }
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
    const bool lists = how.starts_with("list_") || how.ends_with("_type") || how.ends_with("_details") ||
                       how == "publishers" || how == "graph" || how == "types" || how == "record";
    const bool endpoints = how == "stats" || lists || how.find("_param") != how.npos;
    if (endpoints && !is(state::service_endpoints) && state_names()[column].of == dimension::service)
      return "it is the endpoint's";
    if (!endpoints && how != "stop" && is(state::service_endpoints)) return "it is not the endpoint's";
    if (how == "stop" && is(state::service_peers, state::service_own)) return "only the endpoint has it";
    if (how == "reserved" && is(state::service_peers, state::service_own, state::service_endpoints))
      return "nobody can have it";
    if ((how == "made_up" || how == "longest") && is(state::service_own))
      return "no handle of this process has it";
    if (how == "honest" && is(state::service_peers)) return "the process wins over untrusted peers";
  }
  return {};
}

std::string_view name_of(handle_kind kind) {
  constexpr std::string_view names[] = {"publisher of text", "publisher", "subscriber of text", "subscriber",
                                        "responder",         "caller",    "waiting caller",     "lane",
                                        "stop latch",        "recorder"};
  return names[static_cast<std::size_t>(kind)];
}

std::string_view name_of(flow_event what) {
  constexpr std::string_view names[] = {"group of two or more",
                                        "group of 16",
                                        "group, member partly written",
                                        "group, member refused",
                                        "group, member gone",
                                        "send buffer grown",
                                        "send buffer shrunk",
                                        "send buffer given back",
                                        "lone ping",
                                        "second lone ping",
                                        "lone pings, all late",
                                        "lone pings, not low before",
                                        "read alone beyond quantum",
                                        "read alone, in parts",
                                        "read in turn",
                                        "fragments, in parts",
                                        "call beside a flood",
                                        "calls beside a flood",
                                        "calls left behind",
                                        "stop behind a read",
                                        "assembly in front of a read",
                                        "role, by token",
                                        "role, without token",
                                        "role, not admitted",
                                        "role, allowed",
                                        "role, denied to subscribe",
                                        "role, denied to publish",
                                        "role, denied to advertise",
                                        "role, denied to call",
                                        "role, denied to provide",
                                        "role, denied plain messages",
                                        "role, stopped",
                                        "role, reset",
                                        "role, no reset",
                                        "role, may guard",
                                        "role, may not guard",
                                        "rights, kept",
                                        "rights, taken away",
                                        "rights, changed in a handshake",
                                        "rights, look at a list",
                                        "hop, value taken",
                                        "hop, message taken",
                                        "hop, told what is left",
                                        "hop, expired at the hub",
                                        "hop, over at the handle",
                                        "hop, reconnected",
                                        "long, never ends",
                                        "long, byte by byte",
                                        "long, wrong at its end",
                                        "long, two long members",
                                        "long, binary",
                                        "long, envelope of 100 members",
                                        "long, longer than the limit",
                                        "long, a stop",
                                        "long, a call",
                                        "long, no object",
                                        "long, not UTF-8",
                                        "long, leaves in the middle",
                                        "fragments, one missing",
                                        "fragments, no last one",
                                        "fragments, in a fragment",
                                        "fragments, of two messages",
                                        "fragments, to who asked for them",
                                        "fragments, others between them",
                                        "long, reader stalled",
                                        "long, displaced",
                                        "long, evicted",
                                        "long, ping between fragments",
                                        "long, pong between fragments",
                                        "long, close between fragments",
                                        "long, a latched value that is not kept",
                                        "long, latched value read",
                                        "long, to a handle",
                                        "long, arguments of a call",
                                        "long, answer to a call",
                                        "long, call given up",
                                        "long, call without room",
                                        "drive, taken",
                                        "drive, taken over",
                                        "drive, released",
                                        "drive, silent and lost",
                                        "drive, refused: another drives",
                                        "drive, refused: just taken over",
                                        "drive, refused: no right",
                                        "drive, refused: old tick",
                                        "drive, refused: no action",
                                        "drive, stale command",
                                        "drive, unproven command",
                                        "drive, command of another",
                                        "drive, command while stopped",
                                        "drive, command of a time to live",
                                        "drive, offline commands dropped",
                                        "drive, under way at a reset",
                                        "drive, flood of the driver",
                                        "drive, tick of the future",
                                        "drive, driver cut off",
                                        "drive, driver's link stalls",
                                        "drive, obeyed by ticks",
                                        "drive, obeyed without ticks",
                                        "drive, this process",
                                        "drive, silence ends it",
                                        "drive, alone and obeyed",
                                        "anybody takes control",
                                        "anybody gives control back",
                                        "anybody, refused: no topic",
                                        "anybody, refused: no action",
                                        "anybody, refused: old tick",
                                        "anybody, refused: another drives",
                                        "anybody, refused: just taken over",
                                        "anybody hears who drives",
                                        "anybody, command obeyed",
                                        "anybody, this process obeyed",
                                        "anybody, stale command",
                                        "anybody, unproven command",
                                        "anybody, command of another",
                                        "anybody, command while stopped",
                                        "anybody, unreadable command",
                                        "anybody, driven topic reopened",
                                        "anybody hears its rights",
                                        "anybody, rights in plain",
                                        "anybody, rights here",
                                        "anybody, rights elsewhere",
                                        "rights, asked by observer",
                                        "rights, asked by driver",
                                        "rights, asked by supervisor",
                                        "rights, asked by peer",
                                        "rights, asked by arm",
                                        "rights, asked by guard",
                                        "rights, asked by address",
                                        "rights, not asked well"};
  static_assert(std::size(names) == flow_events);
  return names[static_cast<std::size_t>(what)];
}

namespace {

constexpr std::string_view moment_names[] = {"opened",        "latched", "opened_again",   "refused", "used",
                                             "closed_unused", "closed",  "closed_holding", "outlived"};

std::string cell_of(std::uint32_t count, std::string_view why_not) {
  std::array<char, 32> cell;
  if (count == 0 && !why_not.empty()) {
    std::snprintf(cell.data(), cell.size(), " %14s", "-");
  } else {
    std::snprintf(cell.data(), cell.size(), " %14u", count);
  }
  return cell.data();
}

std::string begin_of_row(std::string_view name, int indent) {
  std::array<char, 64> cell;
  std::snprintf(cell.data(), cell.size(), "%*s%-*.*s", indent, "", 34 - indent, static_cast<int>(name.size()),
                name.data());
  return cell.data();
}

std::string heading_of(std::string_view name) {
  std::array<char, 32> cell;
  std::snprintf(cell.data(), cell.size(), " %14.*s", static_cast<int>(name.size()), name.data());
  return cell.data();
}

} // namespace

std::string_view impossible(handle_kind of, moment when) {
  using enum handle_kind;
  const auto is = [of](auto... any) { return ((of == any) || ...); };
  switch (when) {
  case moment::opened_latched:
    return is(publish_text, publish_value) ? "" : "nothing is kept of what it does";
  case moment::refused:
    return is(call, call_wait, talk, latch, record) ? "it takes no place that others want" : "";
  case moment::closed_unused: return is(call_wait, latch) ? "it is used in each step" : "";
  case moment::closed_holding:
    return is(publish_text, publish_value, subscribe_value, latch, record) ? "it holds nothing" : "";
  case moment::outlived:
    return is(subscribe_text, respond, talk) ? "" : "it gives out nothing that could outlive it";
  default: return {};
  }
}

std::vector<std::string> coverage::holes() const {
  std::vector<std::string> found;
  for (std::size_t row = 0; row < rows().size(); ++row) {
    for (std::size_t column = 0; column < states; ++column) {
      if (counts_[row * states + column] != 0 || !impossible(row, column).empty()) continue;
      const state_name& s = state_names()[column];
      found.push_back(text_of(rows()[row]) + " x " + std::string{name_of(s.of)} + " " + std::string{s.name});
    }
  }
  for (std::size_t kind = 0; kind < handle_kinds; ++kind) {
    for (std::size_t when = 0; when < moments; ++when) {
      const handle_kind of{static_cast<std::uint8_t>(kind)};
      const moment at{static_cast<std::uint8_t>(when)};
      if (counts_[place_of(of, at)] == 0 && impossible(of, at).empty())
        found.push_back(std::string{name_of(of)} + " of this process x " + std::string{moment_names[when]});
    }
  }
  for (std::size_t i = 0; i < flow_events; ++i) {
    const flow_event what{static_cast<std::uint8_t>(i)};
    if (counts_[place_of(what)] == 0) found.push_back("flow x " + std::string{name_of(what)});
  }
  return found;
}

std::string coverage::table() const {
  std::string text;
  std::size_t operation = SIZE_MAX;
  for (std::size_t row = 0; row < rows().size(); ++row) {
    const row_name& r = rows()[row];
    if (r.operation != operation) {
      operation = r.operation;
      text += '\n' + begin_of_row(operations()[operation].name, 0);
      for (std::size_t column = 0; column < states; ++column) {
        if (has(row, column)) text += heading_of(state_names()[column].name);
      }
      text += '\n';
    }
    const std::string name =
        r.own ? std::string{"(any)"} : text_of(r).substr(operations()[operation].name.size() + 1);
    text += begin_of_row(name, 2);
    for (std::size_t column = 0; column < states; ++column) {
      if (has(row, column)) text += cell_of(counts_[row * states + column], impossible(row, column));
    }
    text += '\n';
  }
  text += '\n' + begin_of_row("handle of this process", 0);
  for (const std::string_view name : moment_names) text += heading_of(name);
  text += '\n';
  for (std::size_t kind = 0; kind < handle_kinds; ++kind) {
    const handle_kind of{static_cast<std::uint8_t>(kind)};
    text += begin_of_row(name_of(of), 2);
    for (std::size_t when = 0; when < moments; ++when) {
      const moment at{static_cast<std::uint8_t>(when)};
      text += cell_of(counts_[place_of(of, at)], impossible(of, at));
    }
    text += '\n';
  }
  text += '\n' + begin_of_row("flow", 0) + '\n';
  for (std::size_t i = 0; i < flow_events; ++i) {
    const flow_event what{static_cast<std::uint8_t>(i)};
    text += begin_of_row(name_of(what), 2) + cell_of(counts_[place_of(what)], {}) + '\n';
  }
  return text;
}

} // namespace swarm
