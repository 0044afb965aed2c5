// SPDX-License-Identifier: Apache-2.0
// rowe plot: draws fields of topics, of a recording or of a running robot.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "../arguments/command_line.hpp"
#include "../arguments/values.hpp"
#include "../output.hpp"
#include "../plot/chart.hpp"
#include "../plot/html.hpp"
#include "../plot/lettering.hpp"
#include "../plot/png.hpp"
#include "../plot/svg.hpp"
#include "plotting.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

constexpr std::array<std::string_view, 3> plot_formats{"svg", "png", "html"};
enum class plot_format : std::size_t { svg, png, html, by_name };

constexpr std::int64_t side_min = 100, side_max = 8000; // pixels
constexpr double plot_rate_max = 1e6;

command table_of(plot_options& o) {
  return {
      .verb = "plot",
      .examples =
          {{{"rowe plot run.mcap --field /odom:pose.x,pose.y --field /power:volts -o run.svg", "a recording"},
            {"rowe plot ws://127.0.0.1:8080 --field /odom:pose.x --for 10s -o now.html", "a running robot"}}},
      .description =
          "Draws numbers of messages over the time, as SVG, PNG, or an HTML file in which one can zoom. "
          "FILE\n"
          "is what `rowe replay` plays: a recording (MCAP), lines of JSON, or a TUM trajectory. With a URL "
          "it\n"
          "listens to the robot for the time of --for, or until Ctrl-C.\n"
          "\n"
          "Each --field has an axis of its own; the fields of one option, with commas between them, share "
          "it.\n"
          "true and false are 1 and 0. Stops, gaps and lost messages are marked. A line is broken where\n"
          "nothing came for 0.1 s, and for more than four times as long as usual.\n"
          "\n"
          "It exits with 1 if there is no such topic or field, or if parts of the file could not be read.\n",
      .operands = {{.name = "FILE|URL",
                    .meaning = "what was recorded, or where a robot is (default $ROWE_URL)",
                    .into = &o.at.url,
                    .variable = "ROWE_URL"}},
      .options = with_remote(
          o.at,
          {
              {"--output", "-o", "FILE", "the picture: *.svg, *.png or *.html; - is stdout", &o.out},
              {"--field", "-f", "TOPIC:PATH", "what to draw, such as /odom:pose.x (repeatable)", &o.fields},
              {"--xy", "", "TOPIC:X,Y", "a path: Y over X, such as /odom:pose.x,pose.y (repeatable)",
               &o.paths},
              {"--format", "", "NAME", "svg, png or html, where the name of the file does not tell",
               choice{&o.format, plot_formats}},
              {"--size", "", "WxH", "of an SVG or PNG in pixels (default 1200x600)", &o.size},
              {"--title", "", "TEXT", "above the picture (default: the FILE or URL)", any_text{&o.title}},
              {"--dark", "", "", "for a dark ground; without it SVG and HTML follow the reader's screen",
               &o.dark},
              {"--font", "", "FILE", "the font of a PNG (default: DejaVu Sans)", &o.font},
              {"--from", "", "TIME", "from there: 90s or 1:30; -10s from the end; 2026-11-30T04:10:00Z",
               &o.from},
              {"--to", "", "TIME", "until there, likewise", &o.to},
              {"--topic", "", "NAME", "of a trajectory (default /odom), or of lines that are bodies",
               &o.topic},
              {"--rate", "", "HZ", "of lines that have no times", rate{&o.rate_hz, plot_rate_max}},
              {"--for", "", "TIME", "how long to listen to a robot (default 10s)", time_span{&o.time}},
              {"--timeout", "", "TIME", "how long to wait for the connection (default: until Ctrl-C)",
               time_span{&o.timeout}},
              {"--quiet", "-q", "", "print errors only", &o.quiet},
          })};
}

// A file that is there; or what is called like one, and not like a host with a port.
bool names_a_file(const std::string& word) {
  struct stat found {};
  if (::stat(word.c_str(), &found) == 0) return true;
  if (word.find("://") != word.npos || word.find(':') != word.npos) return false;
  constexpr std::array<std::string_view, 5> endings{".mcap", ".jsonl", ".json", ".txt", ".tum"};
  return word.starts_with('/') || word.starts_with("./") || word.starts_with("../") ||
         std::ranges::any_of(endings, [&](std::string_view one) { return word.ends_with(one); });
}

// Nothing: neither the option nor the name says it.
std::optional<plot_format> format_of(const plot_options& o) {
  const auto asked = static_cast<plot_format>(o.format);
  if (asked != plot_format::by_name) return asked;
  for (std::size_t i = 0; i < plot_formats.size(); ++i)
    if (o.out.ends_with(joined(".", plot_formats[i]))) return static_cast<plot_format>(i);
  return std::nullopt;
}

// "1200x600". Empty: it is in `into`.
std::string read_size(const std::string& text, chart_options& into) {
  if (text.empty()) return {};
  const std::size_t by = std::min(text.find('x'), text.size() - 1);
  const std::string_view all = text;
  const auto side_of = [](std::string_view word) {
    const std::int64_t pixels = integer_of(word).value_or(0);
    return pixels >= side_min && pixels <= side_max ? static_cast<std::size_t>(pixels) : 0;
  };
  const std::size_t width = side_of(all.substr(0, by)), height = side_of(all.substr(by + 1));
  if (width == 0 || height == 0)
    return joined("--size needs a width and a height of ", side_min, " to ", side_max,
                  " pixels, such as 1200x600, not ", quoted(text));
  into.width = width;
  into.height = height;
  return {};
}

struct plot_job {
  plot_request what;
  chart_options chart;
  plot_format format = plot_format::svg;
  bool from_file = false;
};

// What of the options does not fit together; empty: nothing.
std::string plot_contradiction(const plot_options& o, const plot_job& job) {
  if (o.fields.empty() && o.paths.empty()) return "--field TOPIC:PATH is missing, or --xy TOPIC:X,Y";
  if (!o.fields.empty() && !o.paths.empty()) return "--field and --xy are two pictures";
  if (!o.paths.empty() && job.format == plot_format::html) return "--xy is drawn as svg or png, not as html";
  if (job.format == plot_format::html && !o.size.empty())
    return "--size is for svg and png; an HTML file is as large as the window";
  if (job.from_file && o.time) return "--for is for a robot; --from and --to choose a part of a file";
  if (!job.from_file && (!o.from.empty() || !o.to.empty() || !o.topic.empty() || o.rate_hz))
    return joined("--from, --to, --topic and --rate are for files; ", quoted(o.at.url), " is not one");
  return {};
}

// Empty: `job` is what is wanted.
std::string plan_plot(const plot_options& o, plot_job& job) {
  if (o.out.empty()) return "--output FILE is missing: where the picture goes, such as -o plot.svg";
  const auto format = format_of(o);
  if (!format)
    return joined(quoted(o.out), " does not say what picture it is to be: *.svg, *.png, *.html, or --format");
  job.format = *format;
  job.from_file = names_a_file(o.at.url);
  if (std::string wrong = plot_contradiction(o, job); !wrong.empty()) return wrong;
  if (std::string wrong = read_size(o.size, job.chart); !wrong.empty()) return wrong;
  std::string wrong;
  auto wishes = o.fields.empty() ? paths_of(o.paths, wrong) : fields_of(o.fields, wrong);
  if (!wishes) return wrong;
  job.what.wishes = std::move(*wishes);
  std::size_t lanes = 1;
  for (const field_wish& one : job.what.wishes) lanes = std::max(lanes, one.lane + 1);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const auto in_lane = std::ranges::count(job.what.wishes, lane, &field_wish::lane);
    if (std::cmp_greater(in_lane, looks_max))
      return joined(in_lane, " lines on one axis are too many: at most ", looks_max);
  }
  if (job.format != plot_format::html && job.chart.height < height_for(lanes))
    return joined(lanes, lanes == 1 ? " axis needs" : " axes need", " a --size of ", height_for(lanes),
                  " pixels in height");
  const bool is_html = job.format == plot_format::html;
  job.what.columns = is_html ? html_columns : columns_of_lines(job.chart.width);
  const std::size_t name = job.from_file ? o.at.url.rfind('/') + 1 : 0;
  job.chart.title = printable(o.title.empty() ? o.at.url.substr(name) : o.title.back());
  return {};
}

// What is better known before a long file is read. Empty: nothing is wrong.
std::string obstacle_to_writing(const plot_options& o, const plot_job& job) {
  std::string why;
  if (job.format == plot_format::png && !lettering::open(o.font, why)) return why;
  const std::size_t slash = o.out.rfind('/');
  const std::string folder = slash == o.out.npos ? "." : o.out.substr(0, slash + 1);
  if (o.out != "-" && ::access(folder.c_str(), W_OK) != 0 && ::access(o.out.c_str(), W_OK) != 0)
    return joined("cannot write ", printable(o.out), ": ", std::strerror(errno));
  return {};
}

std::optional<std::string> picture_text(const plotted_data& data, const plot_options& o, const plot_job& job,
                                        std::string& why) {
  if (job.format == plot_format::html) return html_of(data, job.chart.title, o.dark);
  const picture drawn = chart_of(data, job.chart);
  const palettes& colours = page_palettes();
  if (job.format == plot_format::svg) return svg_of(drawn, colours, o.dark);
  return png_of(drawn, o.dark ? colours.dark : colours.light, o.font, why);
}

exit_code write_picture(const plotted_data& data, const plot_options& o, const plot_job& job,
                        const console& to) {
  std::string why;
  const auto text = picture_text(data, o, job, why);
  if (!text) {
    to.error(why);
    return exit_code::failed;
  }
  if (o.out == "-") return emit(*text) || !output_failed() ? exit_code::done : exit_code::failed;
  if (const int reason = write_file(o.out, *text); reason != 0) {
    to.error("cannot write ", printable(o.out), ": ", std::strerror(reason));
    return exit_code::failed;
  }
  return exit_code::done;
}

// What a reader of the picture should know besides.
void say_what_was_drawn(const plotted_data& data, const plot_options& o, const console& to) {
  for (const plotted_series& one : data.series) {
    if (one.messages() == 0) to.note("no message of ", printable(one.wish().topic), " is in this time");
    if (const std::string odd = one.oddities(); !odd.empty()) to.note(one.label(), ": ", odd);
  }
  if (const std::uint64_t lost = data.lost_messages(); lost != 0)
    to.note("the recording lacks ", counted(lost, "message"), " that were lost");
  std::uint64_t samples = 0, kept = 0;
  for (const plotted_series& one : data.series) {
    samples += one.samples();
    kept += one.kept();
  }
  to.note(printable(o.out == "-" ? std::string{"stdout"} : o.out), " has ", counted(samples, "sample"),
          kept < samples ? joined(", of which ", kept, " are drawn: the others are between these") : "");
}

} // namespace

bool lacks_a_field(const plotted_data& data, std::uint64_t messages_enough, const console& to) {
  for (const plotted_series& one : data.series) {
    if (one.messages() < messages_enough) continue;
    const std::string wrong = one.nothing_found();
    if (wrong.empty()) continue;
    to.error(wrong);
    return true;
  }
  return false;
}

exit_code plot(argument_list arguments) {
  plot_options chosen;
  chosen.format = static_cast<std::size_t>(plot_format::by_name);
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"plot"};
  to.be_quiet(chosen.quiet);
  plot_job job;
  if (const std::string wrong = plan_plot(chosen, job); !wrong.empty()) return usage_error("plot", wrong);
  if (const std::string obstacle = obstacle_to_writing(chosen, job); !obstacle.empty()) {
    to.error(obstacle);
    return exit_code::failed;
  }
  const plot_outcome got =
      job.from_file ? data_of_file(chosen, job.what, to) : data_of_robot(chosen, job.what, to);
  if (!got.data) return got.end;
  if (lacks_a_field(*got.data, 1, to)) return exit_code::failed;
  const bool is_empty =
      std::ranges::all_of(got.data->series, [](const plotted_series& one) { return one.samples() == 0; });
  if (is_empty) {
    to.error("there is nothing to draw: no message of ", printable(got.data->series.front().wish().topic),
             " came, or is in this time");
    return exit_code::failed;
  }
  const exit_code end = write_picture(*got.data, chosen, job, to);
  if (end == exit_code::done) say_what_was_drawn(*got.data, chosen, to);
  return end == exit_code::done && got.has_faults ? exit_code::failed : end;
}

} // namespace rowe::tools
