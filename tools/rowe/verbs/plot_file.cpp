// SPDX-License-Identifier: Apache-2.0
// rowe plot of a file. It is read once, from the begin of the chosen time to its end, whatever its length is.
#include <algorithm>
#include <memory>
#include <string_view>

#include "../interrupt.hpp"
#include "../recordings/decoders.hpp"
#include "../recordings/own_topics.hpp"
#include "../recordings/reading_progress.hpp"
#include "../recordings/recorded_messages.hpp"
#include "../recordings/time_range.hpp"
#include "plotting.hpp"

namespace rowe::tools {
namespace {

constexpr std::uint64_t messages_between_looks = 4096;
constexpr std::size_t faults_said_max = 10;
constexpr const char* usual_trajectory_topic = "/odom";

std::unique_ptr<recorded_messages> open_plotted(const plot_options& o, const console& to) {
  std::string why;
  const auto kind = kind_of_file(o.at.url, why);
  std::unique_ptr<recorded_messages> file;
  if (kind) {
    reading_progress progress{o.at.url, to.quiet()};
    const auto show = [&](double part) { progress(part); };
    if (*kind == kept_as::recording)
      file = open_recording(o.at.url, why, show);
    else if (*kind == kept_as::lines)
      file = open_lines(o.at.url, {.topic = o.topic, .rate_hz = o.rate_hz}, why, show);
    else
      file = open_trajectory(o.at.url, o.topic.empty() ? usual_trajectory_topic : o.topic, why);
  }
  if (file && file->messages() == 0) {
    why = joined(printable(o.at.url), ": there is no message in it");
    file.reset();
  }
  if (!file) to.error(why);
  return file;
}

// What each of the file's topics is for, by their places.
struct topic_use {
  std::vector<std::size_t> fields{};
  message_decoder decode{};
  bool is_json = false;
  bool is_stops = false;
  bool is_losses = false;

  bool is_wanted() const noexcept { return !fields.empty() || is_stops || is_losses; }
};

// Nothing: `wrong` says which wish the file has no topic for.
std::optional<std::vector<topic_use>> uses_of(const recorded_messages& file, plotted_data& data,
                                              std::string& wrong) {
  std::vector<topic_use> uses;
  std::vector<bool> met(data.series.size());
  std::vector<std::string> names;
  for (const recorded_topic& topic : file.topics()) {
    topic_use use{.fields = data.fields_of_topic(topic.name),
                  .decode = decoder_for(topic),
                  .is_json = topic.encoding == json_encoding,
                  .is_stops = topic.name == stop_state_topic && topic.encoding == json_encoding,
                  .is_losses = topic.name == lost_topic && topic.encoding == json_encoding};
    if (!use.fields.empty() && !use.decode) {
      wrong = joined(printable(topic.name), " is in the encoding ", quoted(topic.encoding),
                     ", which cannot be decoded");
      return std::nullopt;
    }
    for (const std::size_t one : use.fields) {
      met[one] = true;
      plotted_series& series = data.series[one];
      if (series.unit.empty() && topic.schema_encoding == "jsonschema")
        series.unit = unit_in(topic.schema, series.wish().path);
    }
    if (std::ranges::find(names, topic.name) == names.end()) names.push_back(topic.name);
    uses.push_back(std::move(use));
  }
  for (std::size_t i = 0; i < met.size(); ++i) {
    if (met[i]) continue;
    const std::string& topic = data.series[i].wish().topic;
    wrong = joined("the recording has no topic ", quoted(topic), hint_of(topic, names));
    return std::nullopt;
  }
  return uses;
}

class file_plotter {
 public:
  file_plotter(recorded_messages& from, std::vector<topic_use> uses, plotted_data& into)
      : from_{from}, uses_{std::move(uses)}, into_{into} {}

  // To the end of the time; or until a signal came, or a field is not there.
  void read(const time_range& range, reading_progress& progress, const console& to) {
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < uses_.size(); ++i)
      if (uses_[i].is_wanted()) wanted.push_back(i);
    from_.select(range.from_ns, range.until_ns, wanted);
    const auto span = static_cast<double>(std::max<std::int64_t>(range.to_ns - range.from_ns, 1));
    std::uint64_t messages = 0;
    while (const auto message = from_.next()) {
      take(uses_[message->topic], *message);
      if (++messages % messages_between_looks != 0) continue;
      was_interrupted = !progress(static_cast<double>(message->time_ns - range.from_ns) / span);
      if (was_interrupted) return;
      lacks_field = lacks_a_field(into_, messages_without_number_max, to);
      if (lacks_field) return;
    }
  }

  bool was_interrupted = false;
  bool lacks_field = false;
  std::uint64_t no_objects = 0; // messages that could not be decoded

 private:
  void take(const topic_use& use, const kept_message& message) {
    // What is JSON already is looked through once, not twice.
    const auto decoded = use.is_json || !use.decode ? message.data : use.decode(message.data);
    const auto read = decoded ? json_value::parse(*decoded) : result<json_value>{errc::malformed};
    if (!read || read->kind() != json_kind::object) {
      ++no_objects;
      return;
    }
    if (use.is_stops) into_.take_stop_state(*read, message.time_ns);
    if (use.is_losses) into_.take_loss(*read, message.time_ns);
    into_.take(use.fields, *read, message.time_ns);
  }

  recorded_messages& from_;
  std::vector<topic_use> uses_;
  plotted_data& into_;
};

// False: all could be read.
bool say_faults(recorded_messages& file, std::uint64_t no_objects, const console& to) {
  const std::vector<std::string> faults = file.faults();
  for (std::size_t i = 0; i < std::min(faults.size(), faults_said_max); ++i) to.error(faults[i]);
  if (faults.size() > faults_said_max)
    to.error("and ", faults.size() - faults_said_max, " more parts that could not be read");
  if (no_objects != 0) to.error(counted(no_objects, "message"), " could not be read: no JSON object");
  return !faults.empty() || no_objects != 0;
}

} // namespace

plot_outcome data_of_file(const plot_options& o, const plot_request& what, const console& to) {
  const auto file = open_plotted(o, to);
  if (!file) return {.end = interrupt::seen() ? exit_code::interrupted : exit_code::failed};
  std::string wrong;
  const auto range = time_range_of(o.from, o.to, *file, wrong);
  if (!range) {
    to.error(wrong);
    return {.end = exit_code::usage};
  }
  plotted_data data{what.wishes,
                    {.zero_ns = file->begin_ns(),
                     .begin_ns = range->from_ns,
                     .end_ns = range->to_ns,
                     .columns = what.columns}};
  auto uses = uses_of(*file, data, wrong);
  if (!uses) {
    to.error(wrong);
    return {};
  }
  file_plotter reads{*file, std::move(*uses), data};
  {
    reading_progress progress{o.at.url, to.quiet()};
    reads.read(*range, progress, to);
  }
  if (reads.was_interrupted) return {.end = exit_code::interrupted};
  if (reads.lacks_field) return {};
  const bool has_faults = say_faults(*file, reads.no_objects, to);
  return {.data = std::move(data), .end = exit_code::done, .has_faults = has_faults};
}

} // namespace rowe::tools
