// SPDX-License-Identifier: Apache-2.0
#include "robot_view.hpp"

#include <algorithm>

#include "../console.hpp"
#include "../network/statistics.hpp"
#include "../text/amounts.hpp"
#include "../text/json_values.hpp"
#include "../text/page.hpp"
#include "../text/times.hpp"

namespace rowe::tools {
namespace {

std::string text_at(json_value of, std::string_view member) {
  const auto value = of.find(member);
  const std::string text = value ? plain_text_of(*value) : "";
  return text.empty() || text == "null" ? "-" : text;
}
double number_at(json_value of, std::string_view member) {
  const auto value = of.get<double>(member);
  return value ? *value : 0;
}
std::uint64_t count_at(json_value of, std::string_view member) {
  const auto value = of.get<std::uint64_t>(member);
  return value ? *value : 0;
}
json_value list_at(json_value of, std::string_view member) { return of.find(member).value_or(json_value{}); }

void add_table(std::vector<view_line>& to, const text_table& table, std::size_t columns) {
  const text_table::written made = table.lines(columns);
  for (const std::string& line : made.lines) {
    const bool is_heading = made.has_headings && &line == made.lines.data();
    to.push_back({line, is_heading ? line_look::heading : line_look::plain});
  }
}

// As many columns of a text in UTF-8.
std::string cut_at(const std::string& text, std::size_t columns) {
  if (columns == 0 || width_of(text) <= columns) return text;
  std::size_t at = 0;
  for (std::size_t seen = 0; at < text.size(); ++at)
    if ((text[at] & '\xc0') != '\x80' && seen++ == columns) break;
  return text.substr(0, at);
}

} // namespace

void robot_view::take(json_value stats, json_value stop) {
  const double up = number_at(stats, "uptime_s");
  head_ = joined(text_at(stats, "name"), ", up for ",
                 clock_text(std::chrono::duration_cast<rt::duration>(std::chrono::duration<double>(up)), 0),
                 ", ", counted(count_at(stats, "peers"), "peer"), ", longest cycle ",
                 decimal_text(number_at(stats, "cycle_us_max"), 0), " us");
  const std::string state = text_at(stop, "state");
  stop_look_ = state == "stopped" ? line_look::bad : state == "running" ? line_look::good : line_look::plain;
  stop_ = state == "-" ? "stop: not known" : joined("stop: ", state);
  if (state == "stopped") {
    const std::string source = text_at(stop, "source");
    stop_ += joined(", number ", count_at(stop, "number"), ", ", text_at(stop, "cause"),
                    source == "-" ? "" : joined(" by ", source));
  }
  topics_.clear();
  for (const json_value row : list_at(stats, "topics").elements())
    topics_.push_back({.name = text_at(row, "topic"),
                       .type = text_at(row, "type"),
                       .hertz = number_at(row, "rate_hz"),
                       .bytes = number_at(row, "bytes"),
                       .gap_ms = number_at(row, "gap_ms_max"),
                       .subscribers = count_at(row, "subscribers")});
  topics_left_out_ = count_at(stats, "topics_left_out");
  peers_.clear();
  for (const json_value row : list_at(stats, "connections").elements())
    peers_.push_back({text_at(row, "address"), text_at(row, "identity"), text_at(row, "identity_role"),
                      text_at(row, "dialect"), text_at(row, "queued"), text_at(row, "messages_in"),
                      text_at(row, "messages_out"), text_at(row, "silent_s")});
  peers_left_out_ = count_at(stats, "connections_left_out");
  loops_.clear();
  for (const json_value row : list_at(stats, "loops").elements())
    loops_.push_back({text_at(row, "name"), text_at(row, "cycles"), text_at(row, "p50_us"),
                      text_at(row, "p99_us"), text_at(row, "max_us"), text_at(row, "bound_us")});
  take_losses(stats);
}

void robot_view::take_losses(json_value stats) {
  std::map<std::string, std::uint64_t, std::less<>> before;
  for (const auto& [name, of] : losses_) before.emplace(name, of.all);
  losses_.clear();
  for (const counted_loss& one : losses_in(stats)) {
    const auto known = before.find(one.name);
    losses_[one.name] = {one.count, known == before.end() ? one.count : known->second, one.is_chosen};
  }
}

void robot_view::add_losses(std::vector<view_line>& to) const {
  std::string lost;
  std::string thinned;
  bool grows = false;
  for (const auto& [name, of] : losses_) {
    if (of.all == 0) continue;
    std::string& text = of.is_chosen ? thinned : lost;
    text += joined(text.empty() ? "" : ", ", name, " ", of.all);
    if (of.all <= of.before) continue;
    text += joined(" (+", of.all - of.before, ")");
    grows = grows || !of.is_chosen;
  }
  to.push_back({joined("lost: ", lost.empty() ? "none" : lost), grows ? line_look::bad : line_look::plain});
  if (!thinned.empty()) to.push_back({joined("thinned on purpose: ", thinned)});
}

void robot_view::add_topics(std::vector<view_line>& to, topic_order by, std::size_t columns) const {
  std::vector<topic> sorted = topics_;
  const auto larger = [&](auto value_of) {
    std::ranges::stable_sort(sorted,
                             [&](const topic& a, const topic& b) { return value_of(a) > value_of(b); });
  };
  std::ranges::sort(sorted, {}, &topic::name);
  switch (by) {
  case topic_order::rate: larger([](const topic& one) { return one.hertz; }); break;
  case topic_order::bytes: larger([](const topic& one) { return one.bytes_per_second(); }); break;
  case topic_order::gap: larger([](const topic& one) { return one.gap_ms; }); break;
  case topic_order::name: break;
  }
  constexpr std::size_t columns_for_types = 100;
  const bool types = columns == 0 || columns >= columns_for_types;
  text_table table{{{"TOPIC"},
                    {.heading = "TYPE", .if_any = true},
                    {"HZ", cell_side::right},
                    {"LONGEST GAP", cell_side::right},
                    {"SIZE", cell_side::right},
                    {"BYTES/S", cell_side::right},
                    {"SUBSCRIBERS", cell_side::right}}};
  for (const topic& one : sorted) {
    const std::string type = types ? one.type : "-";
    if (one.is_known())
      table.add({one.name, type, decimal_text(one.hertz, 1), joined(decimal_text(one.gap_ms, 1), " ms"),
                 bytes_text(whole_of(one.bytes)), bytes_text(whole_of(one.bytes_per_second())),
                 std::to_string(one.subscribers)});
    else
      table.add({one.name, type, "-", "-", "-", "-", "0"});
  }
  if (table.empty())
    to.push_back({"no topic has had a subscriber"});
  else
    add_table(to, table, columns);
  if (topics_left_out_ != 0) to.push_back({joined("and ", topics_left_out_, " more")});
}

std::vector<view_line> robot_view::lines(topic_order by, std::size_t columns) const {
  std::vector<view_line> all{{head_}, {stop_, stop_look_}};
  add_losses(all);
  all.push_back({});
  add_topics(all, by, columns);
  if (!peers_.empty()) {
    text_table table{{{"PEER"},
                      {.heading = "IDENTITY", .if_any = true},
                      {.heading = "ROLE", .if_any = true},
                      {"FORMAT"},
                      {"QUEUED", cell_side::right},
                      {"IN", cell_side::right},
                      {"OUT", cell_side::right},
                      {"SILENT_S", cell_side::right}}};
    for (const std::vector<std::string>& row : peers_) table.add(row);
    all.push_back({});
    add_table(all, table, columns);
    if (peers_left_out_ != 0) all.push_back({joined("and ", peers_left_out_, " more")});
  }
  if (!loops_.empty()) {
    text_table table{{{"LOOP"},
                      {"CYCLES", cell_side::right},
                      {"P50 US", cell_side::right},
                      {"P99 US", cell_side::right},
                      {"LONGEST US", cell_side::right},
                      {.heading = "BOUND US", .side = cell_side::right, .if_any = true}}};
    for (const std::vector<std::string>& row : loops_) table.add(row);
    all.push_back({});
    add_table(all, table, columns);
  }
  for (view_line& one : all) one.text = cut_at(one.text, columns);
  return all;
}

} // namespace rowe::tools
