// SPDX-License-Identifier: Apache-2.0
#include "compare.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "../rowe/console.hpp"
#include "../rowe/text/json_values.hpp"

namespace rowe::tools::bench {
namespace {

std::string text_at(json_value json, std::string_view path) {
  const auto found = json.find(path);
  return found ? plain_text_of(*found) : std::string{};
}

std::optional<double> number_of(std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// `[[1,2,3],[4,5,6]]`, as three numbers each.
std::vector<bucket> buckets_of(json_value json) {
  std::vector<double> all;
  for (const json_leaf& leaf : leaves_of(json))
    if (const auto n = number_of(leaf.value.text())) all.push_back(*n);
  std::vector<bucket> buckets;
  for (std::size_t i = 0; i + 2 < all.size(); i += 3)
    buckets.push_back({static_cast<std::uint64_t>(all[i]), static_cast<std::uint64_t>(all[i + 1]),
                       static_cast<std::uint64_t>(all[i + 2])});
  return buckets;
}

std::string cell(std::string text, std::size_t width) {
  if (text.size() < width) text.insert(0, width - text.size(), ' ');
  return text;
}

std::string plain(double value) {
  std::array<char, 40> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.6g", value);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

std::string shown(std::string_view key, double value) {
  return key.ends_with("_ns") ? time_text(rt::duration{static_cast<std::int64_t>(value)}) : plain(value);
}

// "1.25"; a dash where there is none.
std::string ratio_text(double before, double after) {
  if (before == 0) return after == 0 ? "1.00" : "-";
  std::array<char, 40> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.2f", after / before);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

// The numbers that are compared, in their order; others of the JSON are for programs.
std::vector<std::string> compared_keys(const earlier& after) {
  std::vector<std::string> keys{"samples", "min_ns"};
  for (const double percent : shown_percentiles) keys.push_back(percentile_key(percent) + "_ns");
  for (const char* const key : {"max_ns", "over", "failed", "unfinished", "measuring_thread.page_faults",
                                "measuring_thread.own_context_switches",
                                "measuring_thread.forced_context_switches", "measuring_thread.allocations"})
    keys.emplace_back(key);
  for (const auto& [key, value] : after.numbers)
    if (key.starts_with("figures.") || key.starts_with("parts.")) keys.push_back(key);
  return keys;
}

void say_settings(std::string& to, const earlier& before, const earlier& after) {
  for (const setting& now : after.settings) {
    const auto then = std::find_if(before.settings.begin(), before.settings.end(),
                                   [&](const setting& s) { return s.name == now.name; });
    const std::string_view value = then == before.settings.end() ? "-" : std::string_view{then->value};
    if (value != now.value)
      to += joined("differs   ", now.name, ": ", printable(value), "  ->  ", now.value, "\n");
  }
}

} // namespace

std::optional<double> earlier::number(std::string_view key) const {
  const auto found =
      std::find_if(numbers.begin(), numbers.end(), [&](const auto& one) { return one.first == key; });
  return found == numbers.end() ? std::nullopt : std::optional{found->second};
}

std::optional<earlier> earlier_of(std::string_view text) {
  const json_value json = read_json(text);
  if (!json.find("bench") || !json.find("machine.line")) return std::nullopt;
  earlier e;
  e.mode = text_at(json, "bench");
  e.machine = text_at(json, "machine.line");
  if (const auto buckets = json.find("buckets_ns")) e.buckets = buckets_of(*buckets);
  for (const json_leaf& leaf : leaves_of(json)) {
    if (leaf.path.find('[') != leaf.path.npos) continue;
    if (leaf.path.starts_with("settings."))
      e.settings.push_back({leaf.path.substr(9), plain_text_of(leaf.value)});
    if (const auto n = number_of(leaf.value.text())) e.numbers.emplace_back(leaf.path, *n);
  }
  return e;
}

std::optional<earlier> read_earlier(const std::string& file, std::string& wrong) {
  std::ifstream from{file};
  if (!from) {
    wrong = joined("cannot read ", quoted(file));
    return std::nullopt;
  }
  const std::string text{std::istreambuf_iterator<char>{from}, {}};
  auto e = earlier_of(text);
  if (!e) wrong = joined(quoted(file), " is no result that `rowe bench --json` wrote");
  return e;
}

std::string comparison_of(const earlier& before, const report& now) {
  const std::string json = json_of(now);
  const earlier after = earlier_of(json).value_or(earlier{});
  std::string text = joined("\nbefore    ", printable(before.machine), "\nafter     ", after.machine, "\n");
  say_settings(text, before, after);
  constexpr std::size_t name_width = 44;
  constexpr std::size_t value_width = 12;
  text += joined(cell("", name_width), cell("before", value_width), cell("after", value_width),
                 cell("after/before", value_width + 2), "\n");
  const bool same_limit = before.number("over_limit_ns") == after.number("over_limit_ns");
  for (const std::string& key : compared_keys(after)) {
    const auto a = before.number(key);
    const auto b = after.number(key);
    if (!a || !b || (key == "over" && !same_limit)) continue;
    text += joined(cell(key, name_width), cell(shown(key, *a), value_width),
                   cell(shown(key, *b), value_width), cell(ratio_text(*a, *b), value_width + 2), "\n");
  }
  return text;
}

} // namespace rowe::tools::bench
