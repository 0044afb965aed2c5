// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "../rowe/console.hpp"

namespace rowe::tools::bench {
namespace {

constexpr std::size_t listed_max = 20; // of the samples above the bound; --json has more
constexpr std::size_t worst_listed = 4;

// Columns of a terminal: "µ" has two bytes and takes one.
std::size_t columns_of(std::string_view text) {
  return text.size() - static_cast<std::size_t>(std::count(text.begin(), text.end(), "µ"[0]));
}

std::string padded(std::string text, std::size_t width) {
  const std::size_t columns = columns_of(text);
  if (columns < width) text.insert(0, width - columns, ' ');
  return text;
}

std::string decimals(double value, int digits) {
  std::array<char, 64> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.*f", digits, value);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

void say_machine(std::string& to, const report& r) {
  to += joined("machine   ", r.where.line(), "\n");
  if (!r.peer.empty()) to += joined("peer      ", r.peer, "\n");
  for (const std::string& warning : r.where.warnings) to += joined("warning   ", warning, "\n");
  to += joined("measured  ", r.measured, "\n");
  to += "settings  ";
  for (std::size_t i = 0; i < r.settings.size(); ++i)
    to += joined(i == 0 ? "" : "; ", r.settings[i].name, " ", r.settings[i].value);
  to += "\n\n";
}

void say_distribution(std::string& to, const rt::histogram& h) {
  const auto row = [&](std::string_view name, rt::duration value, std::uint64_t above) {
    to += joined(padded(std::string{name}, 8), "  ", padded(time_text(value), 9), "  ",
                 padded(std::to_string(above), 11), "\n");
  };
  to += "                   samples above\n";
  row("min", h.min(), h.count());
  for (const double percent : shown_percentiles) {
    const double share = 1 - percent / 100;
    row(percentile_name(percent), h.percentile(percent),
        static_cast<std::uint64_t>(share * static_cast<double>(h.count()) + 0.5));
  }
  row("max", h.max(), 0);
}

void say_samples(std::string& to, std::string_view title, std::span<const sample> list, std::size_t most) {
  constexpr std::size_t in_a_line = 4;
  to += joined(title, "\n");
  list = list.first(std::min(list.size(), most));
  for (std::size_t i = 0; i < list.size(); ++i) {
    to += joined(padded(time_text(list[i].value), 12), " at ", padded(seconds_text(list[i].at), 10));
    if (i % in_a_line == in_a_line - 1 || i + 1 == list.size()) to += "\n";
  }
}

void say_late(std::string& to, const recording& samples) {
  if (samples.bound() != rt::for_ever) {
    to += joined("above ", time_text(samples.bound()), ": ", samples.over_count(), " of ",
                 samples.times().count(), "\n");
    if (samples.over_count() > 0)
      say_samples(to, samples.over_count() > listed_max ? "the first of them:" : "they are:", samples.over(),
                  listed_max);
  }
  if (!samples.worst().empty()) say_samples(to, "the largest:", samples.worst(), worst_listed);
}

void say_parts(std::string& to, const report& r) {
  if (r.parts.empty()) return;
  to += "\n";
  for (const part& p : r.parts) {
    to += joined(p.name, ": p50 ", time_text(p.times->percentile(50)), ", p99 ",
                 time_text(p.times->percentile(99)), ", max ", time_text(p.times->max()), " (",
                 p.times->count(), ")\n");
  }
}

void say_usage(std::string& to, const thread_usage& u) {
  to += joined("measuring thread: page faults ", u.page_faults, ", context switches ", u.waits, " own and ",
               u.preemptions, " forced, ");
  to += u.allocations ? joined("allocations ", *u.allocations, ", locks ", *u.locks, "\n")
                      : std::string{"allocations not counted in this build\n"};
}

void say_bounds(std::string& to, const report& r) {
  for (const bound& b : r.bounds) {
    to += joined(b.held() ? "held:     " : "EXCEEDED: ", b.name, " ", time_text(b.found), ", allowed ",
                 time_text(b.limit), "\n");
  }
}

void say_counts(std::string& to, const pump_counts& c) {
  to += joined(c.intended, " intended, ", c.finished, " finished, ", c.failed, " failed, ", c.unfinished,
               " unfinished");
  if (c.failed + c.unfinished > 0) to += " (those are among the samples, with the time that was waited)";
  to += "\n";
}

} // namespace

std::string percentile_name(double percent) {
  std::array<char, 32> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "p%.10g", percent);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

std::string percentile_key(double percent) {
  std::string name = percentile_name(percent);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

std::string time_text(rt::duration time) {
  constexpr std::array<std::string_view, 4> units{" ns", " µs", " ms", " s"};
  auto value = static_cast<double>(time.count());
  std::size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < units.size(); ++unit) value /= 1000;
  const int digits = unit == 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
  return decimals(value, digits).append(units[unit]);
}

std::vector<bound> bounds_of(const settings& asked, const rt::histogram& found) {
  std::vector<bound> all;
  if (asked.max) all.push_back({"max", *asked.max, found.max()});
  for (const numbered_time& p : asked.percentiles)
    all.push_back({percentile_name(p.number), p.time, found.percentile(p.number)});
  return all;
}

exit_code verdict_of(const report& r) noexcept {
  const bool held = std::all_of(r.bounds.begin(), r.bounds.end(), [](const bound& b) { return b.held(); });
  if (!held) return exit_code::exceeded;
  if (!r.problem.empty() || r.counts.failed > 0) return exit_code::failed;
  if (r.counts.unfinished > 0) return exit_code::timed_out;
  const bool nothing = r.figures.empty() && (r.samples == nullptr || r.samples->times().count() == 0);
  return nothing ? exit_code::interrupted : exit_code::done;
}

std::string text_of(const report& r) {
  std::string text;
  say_machine(text, r);
  if (r.samples != nullptr) {
    say_distribution(text, r.samples->times());
    text += "\n";
    r.samples->times().write_bars([&](std::string_view piece) { text += piece; });
    text += "\n";
    say_late(text, *r.samples);
    say_counts(text, r.counts);
  }
  for (const figure& f : r.figures) text += joined(padded(decimals(f.value, 2), 12), "  ", f.meaning, "\n");
  say_parts(text, r);
  if (r.usage) say_usage(text, *r.usage);
  if (!r.problem.empty()) text += joined("PROBLEM after ", seconds_text(r.ran), ": ", r.problem, "\n");
  say_bounds(text, r);
  return text;
}

std::string hgrm_of(const report& r) {
  std::string text;
  r.samples->times().write_percentiles([&](std::string_view piece) { text += piece; });
  text += joined("#[machine: ", r.where.line(), "]\n");
  if (!r.peer.empty()) text += joined("#[peer: ", r.peer, "]\n");
  text += joined("#[measured: ", r.measured, ", in microseconds]\n");
  return text;
}

} // namespace rowe::tools::bench
