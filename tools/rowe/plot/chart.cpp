// SPDX-License-Identifier: Apache-2.0
#include "chart.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "../console.hpp"
#include "../text/times.hpp"
#include "colours.hpp"
#include "ticks.hpp"

namespace rowe::tools {
namespace {

constexpr double edge = 16;          // around everything
constexpr double title_height = 24;  // the title, and what the marks mean
constexpr double legend_height = 22; // above each lane
constexpr double foot_height = 42;   // the labels of the axis of time, and its caption
constexpr double text_size = 12;
constexpr double title_size = 15;
constexpr double label_gap = 6;
constexpr double lane_height_min = 40;
constexpr double usual_label_width = 60;
constexpr double tick_height = 26; // between two labels, at least
constexpr double tick_width = 90;
constexpr double line_width = 1.5;
constexpr double gap_bar = 4; // how high what marks a gap is
constexpr double loss_width = 2;
constexpr double loss_height = 9;
constexpr double stop_opacity = 0.14;
constexpr std::int64_t has_date_ns = 86'400'000'000'000 * 365; // a time that is counted from 1970

// A rectangle of the picture, and which numbers its edges are.
struct field_of_view {
  double left = 0, top = 0, width = 0, height = 0;
  axis_range x{}, y{};

  double right() const noexcept { return left + width; }
  double bottom() const noexcept { return top + height; }
  double x_of(double value) const noexcept { return left + (value - x.low) / (x.high - x.low) * width; }
  double y_of(double value) const noexcept { return bottom() - (value - y.low) / (y.high - y.low) * height; }
};

std::size_t ticks_in(double pixels, double apart) noexcept {
  return static_cast<std::size_t>(std::max(pixels / apart, 2.0)) + 1;
}

// As much of a text as there is room for.
std::string fitting(std::string text, double room) {
  while (!text.empty() && width_of(text, text_size) > room) {
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80U) text.pop_back();
    if (!text.empty()) text.pop_back();
    if (width_of(text + "…", text_size) <= room) return text + "…";
  }
  return text;
}

class painter {
 public:
  painter(const plotted_data& data, const chart_options& how) : data_{data}, how_{how} {
    made.width = how.width;
    made.height = how.height;
    made.title = how.title;
    add(box{.corner = {}, .width = width(), .height = height(), .colour = tone::surface});
  }

  picture made;

 protected:
  double width() const noexcept { return static_cast<double>(how_.width); }
  double height() const noexcept { return static_cast<double>(how_.height); }
  void add(picture_part part) { made.parts.push_back(std::move(part)); }
  void line(place from, place to, tone colour, double thick = 1) {
    add(stroke{.points = {from, to}, .colour = colour, .width = thick});
  }
  void write(place at, std::string text, side anchor, tone colour, double size = text_size) {
    add(words{.base = at, .text = std::move(text), .anchor = anchor, .colour = colour, .size = size});
  }

  // The title on the left, what the marks mean on the right.
  void head() {
    write({edge, edge + title_size}, how_.title, side::left, tone::ink, title_size);
    double right = width() - edge;
    const auto mark = [&](std::string text, tone colour, double wide, double high) {
      right -= width_of(text, text_size);
      write({right, edge + text_size}, std::move(text), side::left, tone::quiet);
      right -= wide + label_gap;
      add(box{.corner = {right, edge + text_size - high}, .width = wide, .height = high, .colour = colour});
      right -= edge;
    };
    // A path shows where the robot was, not when.
    const std::uint64_t lost = data_.is_over_time() ? data_.lost_messages() : 0;
    const std::size_t gaps = data_.is_over_time() ? data_.gaps() : 0;
    if (lost != 0) mark(counted(lost, "message") + " lost", tone::warn, loss_width * 2, loss_height);
    if (gaps != 0) mark(counted(gaps, "gap"), tone::quiet, 12, gap_bar);
    if (!data_.stops.empty()) mark(counted(data_.stops.size(), "stop"), tone::stop, 12, loss_height);
  }

  // The marks of the numbers upwards, in a view whose range is known; and how wide the labels are.
  void y_axis(const field_of_view& in) {
    for (const tick& one : ticks_between(in.y.low, in.y.high, ticks_in(in.height, tick_height))) {
      const double y = in.y_of(one.at);
      line({in.left, y}, {in.right(), y}, tone::grid);
      write({in.left - label_gap, y + text_size * 0.35}, one.label, side::right, tone::quiet);
    }
  }
  static double label_width(const axis_range& y, double pixels) {
    double widest = 0;
    for (const tick& one : ticks_between(y.low, y.high, ticks_in(pixels, tick_height)))
      widest = std::max(widest, width_of(one.label, text_size));
    return widest + label_gap;
  }
  void x_axis(const field_of_view& in, bool labels) {
    for (const tick& one : ticks_between(in.x.low, in.x.high, ticks_in(in.width, tick_width))) {
      const double x = in.x_of(one.at);
      line({x, in.top}, {x, in.bottom()}, tone::grid);
      if (labels) write({x, in.bottom() + label_gap + text_size}, one.label, side::middle, tone::quiet);
    }
  }
  void frame(const field_of_view& in) {
    add(stroke{.points = {{in.left, in.top},
                          {in.right(), in.top},
                          {in.right(), in.bottom()},
                          {in.left, in.bottom()},
                          {in.left, in.top}},
               .colour = tone::line});
  }

  // Names beside each other, each with its line in front.
  void legend(const field_of_view& in, const std::vector<const plotted_series*>& all) {
    double left = in.left;
    const double share = in.width / static_cast<double>(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      constexpr double sample_width = 22;
      const double y = in.top - label_gap - text_size * 0.35;
      add(stroke{.points = {{left, y}, {left + sample_width, y}},
                 .colour = colour_of_line(i),
                 .width = 3,
                 .broken = dashes_of_line(i)});
      std::string text = fitting(all[i]->label(), share - sample_width - label_gap - edge);
      const double wide = width_of(text, text_size);
      left += sample_width + label_gap;
      write({left, in.top - label_gap}, std::move(text), side::left, tone::ink);
      left += wide + edge;
    }
  }

  void lines(const plotted_series& one, std::size_t look, const field_of_view& in) {
    const bool over_time = one.wish().x_path.empty();
    for (const std::vector<sample>& part : one.lines()) {
      stroke drawn{.colour = colour_of_line(look),
                   .width = line_width,
                   .broken = dashes_of_line(look),
                   .of = one.label()};
      for (const sample& each : part) {
        const double x = over_time ? data_.seconds_of(each.time_ns) : each.other;
        drawn.points.push_back({in.x_of(x), in.y_of(each.value)});
      }
      if (drawn.points.size() == 1) add(dot{.centre = drawn.points.front(), .colour = drawn.colour});
      if (drawn.points.size() > 1) add(std::move(drawn));
    }
  }

  const plotted_data& data_;
  const chart_options& how_;
};

class time_painter : painter {
 public:
  using painter::made;
  using painter::painter;

  void paint() {
    head();
    const std::size_t lanes = data_.lanes();
    const double top = edge + title_height;
    const double each = (height() - top - foot_height) / static_cast<double>(lanes);
    axis_range times{data_.seconds_of(data_.span().begin_ns), data_.seconds_of(data_.span().end_ns)};
    if (!(times.low < times.high)) times = {times.low - 0.5, times.high + 0.5};
    std::vector<field_of_view> views;
    double labels = 0;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      field_of_view in{.top = top + each * static_cast<double>(lane) + legend_height,
                       .height = each - legend_height - label_gap,
                       .x = times,
                       .y = range_of(lane)};
      labels = std::max(labels, label_width(in.y, in.height));
      views.push_back(in);
    }
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      views[lane].left = edge + labels;
      views[lane].width = width() - edge * 2 - labels;
      paint_lane(views[lane], lane, lane + 1 == lanes);
    }
    write({width() - edge, height() - edge * 0.5}, caption_of_time(data_), side::right, tone::quiet);
  }

 private:
  std::vector<const plotted_series*> series_of(std::size_t lane) const {
    std::vector<const plotted_series*> all;
    for (const plotted_series& one : data_.series)
      if (one.wish().lane == lane) all.push_back(&one);
    return all;
  }

  axis_range range_of(std::size_t lane) const {
    std::optional<axis_range> all;
    for (const plotted_series* const one : series_of(lane)) {
      if (one->samples() == 0) continue;
      if (!all) all = axis_range{one->lowest(), one->highest()};
      all = axis_range{std::min(all->low, one->lowest()), std::max(all->high, one->highest())};
    }
    return all ? with_air(all->low, all->high) : axis_range{};
  }

  void paint_lane(const field_of_view& in, std::size_t lane, bool is_last) {
    stops(in);
    x_axis(in, is_last);
    y_axis(in);
    frame(in);
    const std::vector<const plotted_series*> all = series_of(lane);
    legend(in, all);
    for (std::size_t i = 0; i < all.size(); ++i) lines(*all[i], i, in);
    gaps_and_losses(in, lane);
  }

  double x_within(const field_of_view& in, std::int64_t time_ns) const noexcept {
    return std::clamp(in.x_of(data_.seconds_of(time_ns)), in.left, in.right());
  }

  void stops(const field_of_view& in) {
    for (const recorded_stop& one : data_.stops) {
      const double from = x_within(in, one.seen_ns);
      const double to = one.until_ns == 0 ? in.right() : x_within(in, one.until_ns);
      add(box{.corner = {from, in.top},
              .width = std::max(to - from, 1.0),
              .height = in.height,
              .colour = tone::stop,
              .opacity = stop_opacity});
      line({from, in.top}, {from, in.bottom()}, tone::stop, line_width);
    }
  }

  void gaps_and_losses(const field_of_view& in, std::size_t lane) {
    const std::string& topic = data_.topic_of_lane(lane);
    for (const gap& each : data_.gaps_of_topic(topic)) {
      const double from = x_within(in, each.begin_ns), to = x_within(in, each.end_ns);
      add(box{.corner = {from, in.bottom() - gap_bar},
              .width = std::max(to - from, 1.0),
              .height = gap_bar,
              .colour = tone::quiet});
    }
    const auto lost = data_.losses.find(topic);
    if (lost == data_.losses.end()) return;
    for (const auto& [time_ns, count] : lost->second) {
      const double x = x_within(in, time_ns);
      add(box{.corner = {std::min(x, in.right() - loss_width), in.bottom() - gap_bar - loss_height},
              .width = loss_width,
              .height = loss_height,
              .colour = tone::warn});
    }
  }
};

// A path: a metre to the right is as long as one upwards.
class path_painter : painter {
 public:
  using painter::made;
  using painter::painter;

  void paint() {
    head();
    std::vector<const plotted_series*> all;
    for (const plotted_series& one : data_.series) all.push_back(&one);
    field_of_view in{.top = edge + title_height + legend_height};
    in.height = height() - in.top - foot_height;
    set_ranges(in);
    const double labels = label_width(in.y, in.height);
    in.left = edge + labels;
    in.width = width() - edge * 2 - labels;
    stretch(in);
    x_axis(in, true);
    y_axis(in);
    frame(in);
    legend(in, all);
    for (std::size_t i = 0; i < all.size(); ++i) {
      lines(*all[i], i, in);
      begin_and_stops(*all[i], i, in);
    }
    write({width() - edge, height() - edge * 0.5}, joined("the dot is the begin; ", caption()), side::right,
          tone::quiet);
  }

 private:
  std::string caption() const {
    const field_wish& one = data_.series.front().wish();
    return joined(printable(one.x_path), " to the right, ", printable(one.path), " upwards");
  }

  void set_ranges(field_of_view& in) const {
    bool any = false;
    for (const plotted_series& one : data_.series) {
      if (one.samples() == 0) continue;
      in.x = any ? axis_range{std::min(in.x.low, one.x_lowest()), std::max(in.x.high, one.x_highest())}
                 : axis_range{one.x_lowest(), one.x_highest()};
      in.y = any ? axis_range{std::min(in.y.low, one.lowest()), std::max(in.y.high, one.highest())}
                 : axis_range{one.lowest(), one.highest()};
      any = true;
    }
    in.x = with_air(in.x.low, in.x.high);
    in.y = with_air(in.y.low, in.y.high);
  }

  // Widens the range that has more pixels than it needs.
  static void stretch(field_of_view& in) noexcept {
    const double x_size = (in.x.high - in.x.low) / in.width, y_size = (in.y.high - in.y.low) / in.height;
    axis_range& shorter = x_size < y_size ? in.x : in.y;
    const double more = (std::max(x_size, y_size) / std::min(x_size, y_size) - 1) / 2;
    const double by = (shorter.high - shorter.low) * more;
    shorter = {shorter.low - by, shorter.high + by};
  }

  void begin_and_stops(const plotted_series& one, std::size_t look, const field_of_view& in) {
    const std::vector<std::vector<sample>> all = one.lines();
    if (all.empty()) return;
    const auto at = [&](const sample& s) { return place{in.x_of(s.other), in.y_of(s.value)}; };
    add(dot{.centre = at(all.front().front()), .radius = 5, .colour = colour_of_line(look)});
    for (const recorded_stop& stop : data_.stops) {
      const sample* nearest_one = nullptr;
      for (const std::vector<sample>& part : all) {
        for (const sample& each : part)
          if (each.time_ns <= stop.seen_ns || nearest_one == nullptr) nearest_one = &each;
      }
      const place centre = at(*nearest_one);
      add(box{.corner = {centre.x - 4, centre.y - 4}, .width = 8, .height = 8, .colour = tone::stop});
    }
  }
};

} // namespace

double width_of(std::string_view text, double size) noexcept {
  // Of DejaVu Sans, which is a wide one. Digits and most letters are narrower than that.
  constexpr double widest_share = 0.62;
  const auto begins =
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
  return static_cast<double>(begins) * size * widest_share;
}

std::size_t columns_of_lines(std::size_t width) noexcept {
  const double columns = static_cast<double>(width) - edge * 2 - usual_label_width;
  return static_cast<std::size_t>(std::max(columns, 16.0));
}

std::size_t height_for(std::size_t lanes) noexcept {
  const double all = edge + title_height + foot_height +
                     static_cast<double>(lanes) * (lane_height_min + legend_height + label_gap);
  return static_cast<std::size_t>(std::ceil(all));
}

picture chart_of(const plotted_data& data, const chart_options& how) {
  if (data.is_over_time()) {
    time_painter over_time{data, how};
    over_time.paint();
    return std::move(over_time.made);
  }
  path_painter path{data, how};
  path.paint();
  return std::move(path.made);
}

std::string caption_of_time(const plotted_data& data) {
  const std::int64_t zero = data.span().zero_ns;
  return zero < has_date_ns ? "s" : joined("s since ", iso_text(zero, time_zone::local));
}

} // namespace rowe::tools
