// SPDX-License-Identifier: Apache-2.0
#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "../rowe/console.hpp"

namespace rowe::tools::bench {
namespace {

constexpr double picture_width = 960;
constexpr double left = 90, right = 930; // of both plots
constexpr double plot_height = 340;
constexpr std::size_t title_columns = 118; // that fit into a line of it
constexpr double bars_per_decade = 40;

constexpr std::string_view style = R"(<style>
  svg { background: #ffffff; font: 13px sans-serif; }
  text { fill: #1a1a1a; } .title { font-size: 15px; font-weight: bold; } .quiet { fill: #595959; }
  .grid { stroke: #d9d9d9; stroke-width: 1; } .frame { fill: none; stroke: #737373; }
  .now { stroke: #0b61a4; } .bar { fill: #0b61a4; } .was { stroke: #b35c00; stroke-dasharray: 6 3; }
  .line { fill: none; stroke-width: 2; } .bound { stroke: #b3261e; stroke-width: 1.5; stroke-dasharray: 2 3; }
  .mark { fill: none; stroke: #b3261e; stroke-width: 2; }
  @media (prefers-color-scheme: dark) {
    svg { background: #14171a; } text { fill: #ececec; } .quiet { fill: #a6a6a6; }
    .grid { stroke: #34393e; } .frame { stroke: #8c8c8c; }
    .now { stroke: #6cb6ff; } .bar { fill: #6cb6ff; } .was { stroke: #ffb35c; }
    .bound, .mark { stroke: #ff8a80; }
  }
</style>
)";

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : printable(text)) {
    switch (c) {
    case '<': safe += "&lt;"; break;
    case '>': safe += "&gt;"; break;
    case '&': safe += "&amp;"; break;
    case '"': safe += "&quot;"; break;
    default: safe += c;
    }
  }
  return safe;
}

// At blanks, into lines of at most `columns`; a longer word has a line of its own.
std::vector<std::string> wrapped(std::string_view text, std::size_t columns) {
  std::vector<std::string> lines;
  while (text.size() > columns) {
    auto cut = text.rfind(' ', columns);
    if (cut == text.npos) cut = std::min(text.find(' '), text.size());
    lines.emplace_back(text.substr(0, cut));
    text.remove_prefix(std::min(cut + 1, text.size()));
  }
  if (!text.empty()) lines.emplace_back(text);
  return lines;
}

std::string fixed(double value) {
  std::array<char, 40> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.1f", value);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

class canvas {
 public:
  void text(double x, double y, std::string_view what, std::string_view attributes = "") {
    out_ += joined("<text x=\"", fixed(x), "\" y=\"", fixed(y), "\" ", attributes, ">", escaped(what),
                   "</text>\n");
  }
  void line(double x1, double y1, double x2, double y2, std::string_view kind) {
    out_ += joined("<line x1=\"", fixed(x1), "\" y1=\"", fixed(y1), "\" x2=\"", fixed(x2), "\" y2=\"",
                   fixed(y2), "\" class=\"", kind, "\"/>\n");
  }
  void rectangle(double x, double y, double w, double h, std::string_view kind) {
    out_ += joined("<rect x=\"", fixed(x), "\" y=\"", fixed(y), "\" width=\"", fixed(w), "\" height=\"",
                   fixed(h), "\" class=\"", kind, "\"/>\n");
  }
  void circle(double x, double y, std::string_view kind) {
    out_ += joined("<circle cx=\"", fixed(x), "\" cy=\"", fixed(y), "\" r=\"5\" class=\"", kind, "\"/>\n");
  }
  void path(const std::string& points, std::string_view kind) {
    out_ += joined("<path d=\"", points, "\" class=\"", kind, "\"/>\n");
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

// A scale from values to places, logarithmic, in whole decades at its ends or as near as `snap` says.
class log_scale {
 public:
  log_scale(double lowest, double highest, double from, double to)
      : low_{std::log10(lowest)}, high_{std::max(std::log10(highest), low_ + 0.1)}, from_{from}, to_{to} {}
  double operator()(double value) const {
    const double share = (std::log10(value) - low_) / (high_ - low_);
    return from_ + std::clamp(share, 0.0, 1.0) * (to_ - from_);
  }
  // 1, 2 and 5 of each decade, or the decades alone where there are many.
  std::vector<double> ticks() const {
    std::vector<double> all;
    const bool fine = high_ - low_ < 4;
    for (double decade = std::floor(low_); decade <= high_; ++decade) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double value = digit * std::pow(10, decade);
        const double at = std::log10(value);
        if ((fine || digit == 1) && at >= low_ - 1e-9 && at <= high_ + 1e-9) all.push_back(value);
      }
    }
    return all;
  }

 private:
  double low_, high_, from_, to_;
};

// "50 µs": of a tick, which has one figure.
std::string time_label(double ns) {
  std::string label = time_text(rt::duration{std::llround(ns)});
  const auto point = label.find('.');
  if (point != label.npos) label.erase(point, label.find(' ') - point);
  return label;
}

std::vector<bucket> buckets_of(const rt::histogram& h) {
  std::vector<bucket> all;
  const auto max = static_cast<std::uint64_t>(h.max().count());
  for (std::size_t i = 0; i < h.counters().size(); ++i) {
    if (const std::uint64_t count = h.counters()[i].get(); count > 0)
      all.push_back({rt::histogram::lowest_of(i, h.precision_bits()),
                     std::min(rt::histogram::highest_of(i, h.precision_bits()), max), count});
  }
  return all;
}

std::uint64_t total_of(const std::vector<bucket>& buckets) {
  std::uint64_t total = 0;
  for (const bucket& b : buckets) total += b.count;
  return total;
}

double at_least_1(std::uint64_t ns) { return std::max(static_cast<double>(ns), 1.0); }

// What both plots share: the range of times.
struct range {
  double lowest = 1e18;
  double highest = 1;
  void include(double ns) {
    lowest = std::min(lowest, ns);
    highest = std::max(highest, ns);
  }
  void include(const std::vector<bucket>& buckets) {
    if (buckets.empty()) return;
    include(at_least_1(buckets.front().lowest_ns));
    include(at_least_1(buckets.back().highest_ns));
  }
};

// For each share of the samples from 0 on, the value they do not exceed: level where a bucket lasts.
std::string percentile_path(const std::vector<bucket>& buckets, const log_scale& x, const log_scale& y) {
  const auto total = static_cast<double>(total_of(buckets));
  std::string points;
  double passed = 0;
  double x_now = x(1);
  for (const bucket& b : buckets) {
    const std::string level = fixed(y(at_least_1(b.highest_ns)));
    points += joined(points.empty() ? "M" : "L", fixed(x_now), " ", level, " ");
    passed += static_cast<double>(b.count);
    x_now =
        x(total / std::max(total - passed, 0.5)); // the last sample ends one halving behind the one before
    points += joined("L", fixed(x_now), " ", level, " ");
  }
  return points;
}

void draw_frame(canvas& to, double top, std::string_view title, std::string_view x_name,
                std::string_view y_name) {
  to.text(left, top - 12, title, "class=\"title\"");
  to.rectangle(left, top, right - left, plot_height, "frame");
  to.text((left + right) / 2, top + plot_height + 40, x_name, "text-anchor=\"middle\" class=\"quiet\"");
  const std::string y_middle = fixed(top + plot_height / 2);
  to.text(20, top + plot_height / 2, y_name,
          joined("text-anchor=\"middle\" class=\"quiet\" transform=\"rotate(-90 20 ", y_middle, ")\""));
}

void draw_x_tick(canvas& to, double top, double x, std::string_view label) {
  to.line(x, top, x, top + plot_height, "grid");
  to.text(x, top + plot_height + 18, label, "text-anchor=\"middle\"");
}

void draw_y_tick(canvas& to, double y, std::string_view label) {
  to.line(left, y, right, y, "grid");
  to.text(left - 8, y + 4, label, "text-anchor=\"end\"");
}

void draw_bounds(canvas& to, const std::vector<bound>& bounds, const log_scale& x, const log_scale& y) {
  for (const bound& b : bounds) {
    const double at = y(static_cast<double>(b.limit.count()));
    const std::string words =
        joined(b.name, " allowed ", time_text(b.limit), b.held() ? ", held" : ", EXCEEDED");
    if (b.name == "max") {
      to.line(left, at, right, at, "bound");
      to.text(left + 8, at - 6, words);
      continue;
    }
    const double share = 1 - std::stod(b.name.substr(1)) / 100;
    const double place = x(1 / std::max(share, 1e-12));
    to.circle(place, at, "mark");
    const bool near_end = place > (left + right) / 2;
    to.text(place + (near_end ? -10 : 10), at - 8, words, near_end ? "text-anchor=\"end\"" : "");
  }
}

void draw_percentiles(canvas& to, double top, const report& r, const std::vector<bucket>& now,
                      const std::vector<bucket>& before, const range& times) {
  const auto most = static_cast<double>(std::max({total_of(now), total_of(before), std::uint64_t{10}}));
  const log_scale x{1, 2 * most, left, right};
  const log_scale y{times.lowest / 1.2, times.highest * 1.2, top + plot_height, top};
  draw_frame(to, top, "Percentiles", "percentile: share of the samples that are at most so large",
             "time (log)");
  draw_x_tick(to, top, x(1), "0 %");
  draw_x_tick(to, top, x(2), "50 %");
  double rest = 10;
  for (std::string label = "90"; rest < 2 * most; rest *= 10) {
    draw_x_tick(to, top, x(rest), label + " %");
    label = label == "90" ? "99" : label == "99" ? "99.9" : label + "9";
  }
  for (const double tick : y.ticks()) draw_y_tick(to, y(tick), time_label(tick));
  if (!before.empty()) to.path(percentile_path(before, x, y), "line was");
  to.path(percentile_path(now, x, y), "line now");
  draw_bounds(to, r.bounds, x, y);
}

// Buckets put together to bars of equal width on the logarithmic axis.
struct bars {
  double first; // the place of the first, in bars from 1 ns
  std::vector<double> counts;
};

bars bars_of(const std::vector<bucket>& buckets, const range& times) {
  const double first = std::floor(std::log10(times.lowest) * bars_per_decade);
  const double last = std::floor(std::log10(times.highest) * bars_per_decade);
  bars all{first, std::vector<double>(static_cast<std::size_t>(last - first) + 1)};
  for (const bucket& b : buckets) {
    const double middle = std::max((at_least_1(b.lowest_ns) + at_least_1(b.highest_ns)) / 2, times.lowest);
    const double place = std::floor(std::log10(std::min(middle, times.highest)) * bars_per_decade) - first;
    all.counts[static_cast<std::size_t>(place)] += static_cast<double>(b.count);
  }
  return all;
}

double value_at_bar(const bars& b, std::size_t index) {
  return std::pow(10, (b.first + static_cast<double>(index)) / bars_per_decade);
}

void draw_histogram(canvas& to, double top, const report& r, const std::vector<bucket>& now,
                    const std::vector<bucket>& before, const range& times) {
  const bars mine = bars_of(now, times);
  const bars others = bars_of(before, times);
  double most = 10;
  for (const bars* const one : {&mine, &others})
    for (const double count : one->counts) most = std::max(most, count);
  const double lowest = value_at_bar(mine, 0);
  const double highest = value_at_bar(mine, mine.counts.size());
  const log_scale x{lowest, highest, left, right};
  const log_scale y{0.5, most * 1.5, top + plot_height, top};
  draw_frame(to, top, "Histogram", "time (log)", "samples (log)");
  for (const double tick : x.ticks()) draw_x_tick(to, top, x(tick), time_label(tick));
  for (double count = 1; count <= most * 1.5; count *= 10)
    draw_y_tick(to, y(count), std::to_string(static_cast<std::uint64_t>(count)));
  std::string outline;
  for (std::size_t i = 0; i < mine.counts.size(); ++i) {
    const double from = x(value_at_bar(mine, i));
    const double until = x(value_at_bar(mine, i + 1));
    if (mine.counts[i] > 0) {
      const double height = y(mine.counts[i]);
      to.rectangle(from, height, std::max(until - from - 0.5, 0.5), top + plot_height - height, "bar");
    }
    const double level = others.counts[i] > 0 ? y(others.counts[i]) : top + plot_height;
    outline += joined(outline.empty() ? "M" : "L", fixed(from), " ", fixed(level), " L", fixed(until), " ",
                      fixed(level), " ");
  }
  if (!before.empty()) to.path(outline, "line was");
  for (const bound& b : r.bounds) {
    const auto limit = static_cast<double>(b.limit.count());
    if (b.name != "max" || limit > highest || limit < lowest) continue;
    to.line(x(limit), top, x(limit), top + plot_height, "bound");
  }
}

} // namespace

std::string svg_of(const report& r, const earlier* before) {
  const std::vector<bucket> now = buckets_of(r.samples->times());
  const std::vector<bucket> was = before != nullptr ? before->buckets : std::vector<bucket>{};
  range times;
  times.include(now);
  times.include(was);
  if (times.lowest > times.highest) times = {1, 1000}; // nothing was measured
  for (const bound& b : r.bounds) times.include(static_cast<double>(b.limit.count()));

  canvas to;
  double y = 28;
  for (const std::string& line : wrapped(r.where.line(), title_columns)) {
    to.text(20, y, line, "class=\"title\"");
    y += 20;
  }
  std::string about =
      joined("rowe bench ", r.mode, ": ", r.measured, "; ", r.samples->times().count(), " samples");
  for (const setting& s : r.settings) about += joined("; ", s.name, " ", s.value);
  if (before != nullptr) about += joined("; dashed: before, on ", before->machine);
  for (const std::string& line : wrapped(about, title_columns + 20)) {
    to.text(20, y, line, "class=\"quiet\"");
    y += 17;
  }
  const double first_top = y + 36;
  const double second_top = first_top + plot_height + 100;
  draw_percentiles(to, first_top, r, now, was, times);
  draw_histogram(to, second_top, r, now, was, times);
  const std::string height = fixed(second_top + plot_height + 60);
  return joined("<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 ", fixed(picture_width),
                " ", height, "\" width=\"", fixed(picture_width), "\" height=\"", height, "\">\n<title>",
                escaped(r.where.line()), "</title>\n<desc>", escaped(about), "</desc>\n", style, to.take(),
                "</svg>\n");
}

} // namespace rowe::tools::bench
