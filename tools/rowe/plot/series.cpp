// SPDX-License-Identifier: Apache-2.0
#include "series.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "../console.hpp"
#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t loss_columns = 1000; // losses that come closer together are one mark

// The distance between two numbers is one that a double holds.
constexpr double number_max = 8e307;

bool is_earlier(const sample& one, const sample& other) noexcept { return one.time_ns < other.time_ns; }

} // namespace

plotted_series::plotted_series(field_wish wish, const plotted_span& span)
    : wish_{std::move(wish)}, over_y_{span.begin_ns, span.end_ns, span.columns} {
  if (!wish_.x_path.empty()) over_x_.emplace(span.begin_ns, span.end_ns, span.columns);
}

std::string plotted_series::label() const {
  const std::string name =
      wish_.x_path.empty() ? wish_.name() : joined(wish_.topic, ":", wish_.x_path, ",", wish_.path);
  return printable(unit.empty() ? name : joined(name, " [", unit, "]"));
}

std::optional<double> plotted_series::number_at(json_value message, std::string_view path) {
  is_no_number why = is_no_number::missing;
  if (const auto value = message.find(path)) {
    switch (value->kind()) {
    case json_kind::number:
      if (const auto number = value->get<double>(); number && std::abs(*number) <= number_max) return *number;
      why = is_no_number::huge;
      break;
    case json_kind::boolean: return value->text() == "true" ? 1 : 0;
    case json_kind::null: why = is_no_number::null; break;
    case json_kind::string: why = is_no_number::text; break;
    case json_kind::object: why = is_no_number::object; break;
    case json_kind::array: why = is_no_number::array; break;
    }
  }
  ++no_numbers_[static_cast<std::size_t>(why)];
  if (samples() == 0 && example_.empty()) example_ = message.text();
  return std::nullopt;
}

void plotted_series::take(json_value message, std::int64_t time_ns) {
  ++messages_;
  const auto y = number_at(message, wish_.path);
  if (!y) return;
  double x = 0;
  if (over_x_) {
    const auto read = number_at(message, wish_.x_path);
    if (!read) return;
    x = *read;
    over_x_->add({.time_ns = time_ns, .value = x, .other = *y});
  }
  over_y_.add({.time_ns = time_ns, .value = *y, .other = x});
  pauses_.add(time_ns);
}

std::vector<sample> plotted_series::drawn() const {
  std::vector<sample> all = over_y_.kept();
  if (!over_x_) return all;
  for (const sample& one : over_x_->kept())
    all.push_back({.time_ns = one.time_ns, .value = one.other, .other = one.value});
  std::stable_sort(all.begin(), all.end(), is_earlier);
  const auto as_tuple = [](const sample& one) { return std::tie(one.time_ns, one.value, one.other); };
  const auto same = [&](const sample& one, const sample& other) { return as_tuple(one) == as_tuple(other); };
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
  return all;
}

std::size_t plotted_series::kept() const { return drawn().size(); }

std::vector<std::vector<sample>> plotted_series::lines() const {
  std::vector<std::vector<sample>> all;
  const std::vector<gap> breaks = gaps();
  auto next = breaks.begin();
  for (const sample& one : drawn()) {
    bool is_broken = all.empty();
    while (next != breaks.end() && next->end_ns <= one.time_ns) {
      is_broken = true;
      ++next;
    }
    if (is_broken) all.emplace_back();
    all.back().push_back(one);
  }
  return all;
}

std::string plotted_series::oddities() const {
  constexpr std::array<std::string_view, kinds> names{"nothing",   "null",     "a text",
                                                      "an object", "an array", "beyond 8e307"};
  std::uint64_t all = 0;
  std::string text;
  for (std::size_t i = 0; i < kinds; ++i) {
    if (no_numbers_[i] == 0) continue;
    all += no_numbers_[i];
    text += joined(text.empty() ? "" : ", ", no_numbers_[i], " ", names[i]);
  }
  if (all == 0) return {};
  return joined(counted(all, "message"), all == 1 ? " has" : " have", " no number there (", text, ")");
}

std::string plotted_series::nothing_found() const {
  if (samples() != 0 || messages_ == 0) return {};
  const json_value seen = read_json(example_);
  const bool has_y =
      !wish_.x_path.empty() && seen.find(wish_.path) && seen.find(wish_.path)->kind() == json_kind::number;
  const std::string& path = has_y ? wish_.x_path : wish_.path;
  const auto found = seen.find(path);
  constexpr std::string_view what[] = {"an object", "an array", "a text", "a number", "a bool", "null"};
  const std::string begin = found
                                ? joined(quoted(path), " is ", what[static_cast<std::size_t>(found->kind())],
                                         " in the messages of ", printable(wish_.topic))
                                : joined("messages of ", printable(wish_.topic), " have no ", quoted(path));
  return begin + hint_of_path(path, seen);
}

plotted_data::plotted_data(const std::vector<field_wish>& wishes, const plotted_span& span) : span_{span} {
  for (const field_wish& one : wishes) series.emplace_back(one, span);
}

std::vector<std::size_t> plotted_data::fields_of_topic(std::string_view topic) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < series.size(); ++i)
    if (is_same_name(series[i].wish().topic, topic)) found.push_back(i);
  return found;
}

void plotted_data::take(const std::vector<std::size_t>& fields, json_value message, std::int64_t time_ns) {
  for (const std::size_t one : fields) series[one].take(message, time_ns);
}

void plotted_data::take_loss(json_value said, std::int64_t time_ns) {
  const auto loss = loss_in(said);
  if (!loss) return;
  const std::vector<std::size_t> fields = fields_of_topic(loss->topic);
  if (fields.empty()) return;
  const std::int64_t step = (span_.end_ns - span_.begin_ns) / static_cast<std::int64_t>(loss_columns) + 1;
  const std::int64_t at = std::max(span_.begin_ns, time_ns - (time_ns - span_.begin_ns) % step);
  losses[series[fields.front()].wish().topic][at] += loss->messages;
}

std::size_t plotted_data::lanes() const noexcept {
  std::size_t most = 0;
  for (const plotted_series& one : series) most = std::max(most, one.wish().lane + 1);
  return most;
}

bool plotted_data::is_over_time() const noexcept {
  return series.empty() || series.front().wish().x_path.empty();
}

// All fields of a lane were given by one option, which names one topic.
const std::string& plotted_data::topic_of_lane(std::size_t lane) const noexcept {
  return std::ranges::find_if(series, [&](const plotted_series& one) { return one.wish().lane == lane; })
      ->wish()
      .topic;
}

std::uint64_t plotted_data::lost_messages() const {
  std::uint64_t all = 0;
  for (const auto& [topic, marks] : losses) {
    for (const auto& [time_ns, count] : marks) all += count;
  }
  return all;
}

std::vector<gap> plotted_data::gaps_of_topic(std::string_view topic) const {
  std::vector<gap> all;
  for (const std::size_t one : fields_of_topic(topic)) {
    const std::vector<gap> more = series[one].gaps();
    all.insert(all.end(), more.begin(), more.end());
  }
  const auto earlier = [](const gap& one, const gap& other) {
    return std::tie(one.begin_ns, one.end_ns) < std::tie(other.begin_ns, other.end_ns);
  };
  const auto same = [&](const gap& one, const gap& other) {
    return !earlier(one, other) && !earlier(other, one);
  };
  std::sort(all.begin(), all.end(), earlier);
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
  return all;
}

std::size_t plotted_data::gaps() const {
  std::set<std::string_view> topics;
  for (const plotted_series& one : series) topics.insert(one.wish().topic);
  std::size_t all = 0;
  for (const std::string_view one : topics) all += gaps_of_topic(one).size();
  return all;
}

} // namespace rowe::tools
