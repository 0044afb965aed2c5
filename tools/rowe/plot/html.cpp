// SPDX-License-Identifier: Apache-2.0
#include "html.hpp"

#include <array>
#include <charconv>

#include "../console.hpp"
#include "../text/json_values.hpp"
#include "../text/times.hpp"
#include "chart.hpp"
#include "page_files.hpp"

namespace rowe::tools {
namespace {

constexpr int value_digits = 9; // more than any screen shows, however far one zooms
constexpr int time_decimals = 6;

// A text as JSON that a script element can hold: nothing in it ends the element.
std::string json_text(std::string_view text) {
  std::string safe;
  for (const char c : json_string_of(text)) safe += c == '<' ? std::string{"\\u003c"} : std::string{c};
  return safe;
}

std::string value_text(double value) {
  std::array<char, 40> text{};
  const auto written =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, value_digits);
  return {text.data(), written.ptr};
}

std::string time_text(double seconds) {
  std::string text = decimal_text(seconds, time_decimals);
  while (text.ends_with('0')) text.pop_back();
  if (text.ends_with('.')) text.pop_back();
  return text;
}

class page_data {
 public:
  explicit page_data(const plotted_data& of) : of_{of} {}

  std::string text(const std::string& title) const {
    std::string lanes;
    for (std::size_t lane = 0; lane < of_.lanes(); ++lane)
      lanes += (lane == 0 ? "" : ",\n") + lane_text(lane);
    std::string stops;
    for (const recorded_stop& one : of_.stops) {
      const std::int64_t until = one.until_ns == 0 ? of_.span().end_ns : one.until_ns;
      stops += joined(stops.empty() ? "" : ",", "{\"from\":", at(one.seen_ns), ",\"to\":", at(until),
                      ",\"number\":", one.number, ",\"cause\":", json_text(printable(one.cause)),
                      ",\"source\":", json_text(printable(one.source)), "}");
    }
    return joined("{\"title\":", json_text(title), ",\"caption\":", json_text(caption_of_time(of_)),
                  ",\"from\":", at(of_.span().begin_ns), ",\"to\":", at(of_.span().end_ns), ",\"stops\":[",
                  stops, "],\"gaps\":", of_.gaps(), ",\"lost\":", of_.lost_messages(), ",\"lanes\":[\n",
                  lanes, "]}");
  }

 private:
  std::string at(std::int64_t time_ns) const { return time_text(of_.seconds_of(time_ns)); }

  std::string gaps_text(const std::vector<gap>& gaps) const {
    std::string text;
    for (const gap& each : gaps)
      text += joined(text.empty() ? "[" : ",[", at(each.begin_ns), ",", at(each.end_ns), "]");
    return text;
  }

  std::string lane_text(std::size_t lane) const {
    std::string fields, lost;
    for (const plotted_series& one : of_.series)
      if (one.wish().lane == lane) fields += (fields.empty() ? "" : ",\n") + field_text(one);
    if (const auto marks = of_.losses.find(of_.topic_of_lane(lane)); marks != of_.losses.end()) {
      for (const auto& [time_ns, count] : marks->second)
        lost += joined(lost.empty() ? "[" : ",[", at(time_ns), ",", count, "]");
    }
    return joined("{\"fields\":[\n", fields, "],\"gaps\":[",
                  gaps_text(of_.gaps_of_topic(of_.topic_of_lane(lane))), "],\"lost\":[", lost, "]}");
  }

  std::string field_text(const plotted_series& one) const {
    std::string times, values;
    for (const std::vector<sample>& line : one.lines()) {
      for (const sample& each : line) {
        const std::string_view between = times.empty() ? "" : ",";
        times.append(between).append(at(each.time_ns));
        values.append(between).append(value_text(each.value));
      }
    }
    return joined("{\"name\":", json_text(printable(one.wish().name())),
                  ",\"unit\":", json_text(printable(one.unit)), ",\"samples\":", one.samples(),
                  ",\"kept\":", one.kept(), ",\"gaps\":[", gaps_text(one.gaps()), "],\"t\":[", times,
                  "],\"v\":[", values, "]}");
  }

  const plotted_data& of_;
};

// The colours of the night, on a screen that prefers the day, too.
std::string dark_rules() {
  const std::string_view css = page_files::colours();
  const std::size_t night = css.find(":root", css.find("prefers-color-scheme"));
  return night == css.npos ? "" : std::string{css.substr(night, css.find('}', night) - night + 1)};
}

// A file that one makes smaller says where the larger one is; here is none.
std::string_view without_source_map(std::string_view file) {
  const std::size_t at = file.rfind("# sourceMappingURL");
  return at == file.npos ? file : file.substr(0, file.rfind('\n', at) + 1);
}

std::string escaped_html(std::string_view text) {
  std::string safe;
  for (const char c : text)
    safe += c == '<' ? std::string{"&lt;"} : c == '&' ? std::string{"&amp;"} : std::string{c};
  return safe;
}

} // namespace

std::string html_of(const plotted_data& data, const std::string& title, bool dark) {
  return joined("<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n"
                "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
                "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
                "<meta name=\"viewport\" content=\"width=device-width\">\n<title>",
                escaped_html(title), "</title>\n<style>", without_source_map(page_files::dygraphs_style()),
                page_files::style(), dark ? dark_rules() : std::string{},
                "</style>\n<h1></h1>\n<p id=\"marks\"></p>\n<main></main>\n<p id=\"foot\"></p>\n"
                "<script type=\"application/json\" id=\"data\">",
                page_data{data}.text(title), "</script>\n<script type=\"text/plain\">",
                page_files::dygraphs_licence(), "</script>\n<script>",
                without_source_map(page_files::dygraphs()), "</script>\n<script>", page_files::script(),
                "</script>\n</html>\n");
}

} // namespace rowe::tools
