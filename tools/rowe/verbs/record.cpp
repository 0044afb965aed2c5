// SPDX-License-Identifier: Apache-2.0
// rowe record: writes what a robot publishes into files, and repairs such files.
#include <sys/stat.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <rowe/access.hpp>
#include <rowe/endpoint.hpp>
#include <rowe/recording.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../arguments/values.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/asked_robot.hpp"
#include "../network/missing_publishers.hpp"
#include "../network/remote.hpp"
#include "../network/robot_names.hpp"
#include "../network/robot_types.hpp"
#include "../network/subscriptions.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/amounts.hpp"
#include "../text/json_values.hpp"
#include "record_modes.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration answer_time = 2s;
constexpr rt::duration topics_period = 1s; // for topics that are new
constexpr rt::duration progress_period = 500ms;
constexpr std::uint32_t recorded_topics_max = 900;
constexpr std::size_t parameters_max = 500;

struct record_settings {
  remote_place at;
  std::vector<std::string> words; // topics, or files to be repaired
  std::vector<std::string> exclude;
  std::string to;
  std::string split;
  std::string total;
  std::size_t packed = 0;
  std::optional<rt::duration> duration;
  std::optional<rt::duration> timeout;
  std::optional<double> hertz; // of each topic at most; nothing: all messages
  std::string cause;           // of a snapshot
  bool sync = false;
  bool repair = false;
  bool snapshot = false;
  bool quiet = false;
};

constexpr std::array<std::string_view, 3> packings{"lz4", "zstd", "none"};

command table_of(record_settings& o) {
  return {
      .verb = "record",
      .examples = {{{"rowe record ws://127.0.0.1:8080", "all topics, until Ctrl-C"},
                    {"rowe record 127.0.0.1:8080 /odom '/arm/**' -o run.mcap", "some of them"}}},
      .description =
          "Records topics into a file (MCAP, which Foxglove opens), until Ctrl-C or SIGTERM. In a TOPIC `*`\n"
          "stands for any text without a slash, `**` for any text. Without TOPICs all are recorded, those\n"
          "of the endpoint below /rowe/ included: they say when it was stopped, and what was lost. What the\n"
          "recorder itself loses is counted, and the file says so. A file whose program was killed, or that\n"
          "is damaged, is made whole by --repair: its words are FILEs then. --snapshot asks the black boxes "
          "of a\n"
          "robot to write what they retain, on the robot.\n",
      .operands =
          {[&] {
             operand url = url_operand(o.at.url);
             url.left_out = &o.repair;
             return url;
           }(),
           {.name = "TOPIC", .meaning = "their names, or patterns", .into = &o.words, .optional = true}},
      .options = with_remote(
          o.at,
          {
              {"--output", "-o", "PATH",
               "a file, or a folder for files with the robot's name and the time (default: the present one)",
               &o.to},
              {"--exclude", "", "TOPIC", "but not these", &o.exclude},
              {"--split", "", "SIZE|TIME", "another file begins after 1GiB, or 10m", &o.split},
              {"--max-total", "", "SIZE", "of all files of this name: the oldest ones are deleted", &o.total},
              {"--compression", "", "NAME", "lz4 (the default), zstd or none", choice{&o.packed, packings}},
              {"--sync", "", "", "wait for the disk after each chunk: for when the power may fail", &o.sync},
              {"--duration", "", "TIME", "end after so long", time_span{&o.duration}},
              {"--timeout", "", "TIME", "how long to wait for the connection (default: until Ctrl-C)",
               time_span{&o.timeout}},
              {"--throttle", "", "HZ",
               "at most as many messages of a topic a second: the robot leaves out the others",
               rate{&o.hertz, 1000}},
              {"--snapshot", "", "", "have the robot's black boxes write; nothing is recorded here",
               &o.snapshot},
              {"--cause", "", "TEXT", "with --snapshot: why, for who looks into the file", &o.cause},
              {"--repair", "", "", "make the FILEs whole; nothing is recorded", &o.repair},
              {"--quiet", "-q", "", "print errors only", &o.quiet},
          })};
}

// What is wrong with the options; empty: they are in `file` now.
std::string read_file_options(const record_settings& o, recording_options& file) {
  file.path = o.to.empty() ? "./" : o.to;
  file.packed = o.packed == 0 ? compression::lz4 : o.packed == 1 ? compression::zstd : compression::none;
  file.sync = o.sync;
  if (!o.split.empty()) {
    const auto bytes = bytes_of(o.split);
    const auto time = duration_of(o.split);
    if (!bytes && (!time || *time <= rt::duration{0}))
      return joined("--split takes a size or a time (1GiB, 10m), not ", quoted(o.split));
    file.split_bytes = bytes.value_or(0);
    if (!bytes) file.split_time = *time;
  }
  if (!o.total.empty()) {
    const auto bytes = bytes_of(o.total);
    if (!bytes) return joined("--max-total takes a size (10GiB), not ", quoted(o.total));
    if (*bytes < 1 << 20) return joined("--max-total needs 1MiB at least, not ", quoted(o.total));
    file.total_bytes = *bytes;
  }
  return {};
}

bool is_pattern(std::string_view topic) noexcept { return topic.find('*') != std::string_view::npos; }

// Of the words those that are no patterns.
std::vector<std::string> names_in(const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const std::string& word : words)
    if (!is_pattern(word)) names.push_back(with_slash(word));
  return names;
}

// ---- recording

// Subscribes to the robot's topics as they come.
class topics_of_robot {
 public:
  topics_of_robot(service_asker& robot, recorder& into, const record_settings& o, const console& to)
      : robot_{robot}, into_{into}, chosen_{o}, to_{to} {}

  // Those without a pattern need not be there yet.
  void subscribe_named() {
    for (const std::string& name : names_in(chosen_.words)) subscribe(name, {});
  }

  // Looks which there are. False: the robot does not say.
  bool look() {
    const auto all = names_of(robot_, name_kind::topic);
    if (!all) return false;
    if (!std::exchange(looked_, true)) tell_what_matches_nothing(*all);
    const auto is_new = [&](const robot_name& one) { return !known_.contains(one.name); };
    if (describes_ && std::ranges::any_of(*all, is_new)) describes_ = types_.read_all(robot_);
    for (const robot_name& one : *all) subscribe(one.name, one.type);
    return true;
  }

 private:
  void tell_what_matches_nothing(const std::vector<robot_name>& all) const {
    for (const std::string& pattern : chosen_.words) {
      const auto is_meant = [&](const robot_name& one) { return pattern_matches(pattern, one.name); };
      if (is_pattern(pattern) && std::ranges::none_of(all, is_meant))
        to_.note("no topic matches ", quoted(pattern), " yet; waiting for one (Ctrl-C to stop)");
    }
  }

  void subscribe(const std::string& name, std::string_view type) {
    if (known_.contains(name) || name.empty()) return;
    if (known_.size() == recorded_topics_max) {
      if (!std::exchange(too_many_, true))
        to_.error("there are more topics than ", recorded_topics_max, ": the others are not recorded");
      return;
    }
    const typed_name* const described = types_.find_topic(name);
    const status done = into_.subscribe(name, type, described == nullptr ? nullptr : described->message,
                                        chosen_.hertz ? throttle_of(*chosen_.hertz) : rt::duration{});
    if (!done) to_.error("cannot record ", quoted(name), ": ", done.error().message());
    known_.emplace(name, static_cast<bool>(done));
  }

  service_asker& robot_;
  recorder& into_;
  const record_settings& chosen_;
  const console& to_;
  robot_types types_;
  bool looked_ = false;
  bool describes_ = true; // the robot says its types
  bool too_many_ = false;
  std::map<std::string, bool> known_;
};

// Says now and then on a terminal how far it is.
class recording_progress_line {
 public:
  explicit recording_progress_line(bool quiet) : shown_{!quiet && status_line::is_possible()} {}
  ~recording_progress_line() { status_line::clear(); }
  recording_progress_line(const recording_progress_line&) = delete;
  recording_progress_line& operator=(const recording_progress_line&) = delete;

  void show(const recording_figures& now, rt::time_point at) {
    if (!shown_ || at - at_ < progress_period) return;
    const double seconds = std::chrono::duration<double>(at - at_).count();
    const double rate = at_ == rt::time_point{} ? 0 : static_cast<double>(now.bytes - bytes_) / seconds;
    at_ = at;
    bytes_ = now.bytes;
    status_line::show(joined(counted(now.messages, "message"), ", ", bytes_text(now.bytes), ", ",
                             bytes_text(static_cast<std::uint64_t>(rate)), "/s, ", bytes_text(now.disk_free),
                             " free", now.lost == 0 ? "" : joined(", lost ", now.lost)));
  }

 private:
  bool shown_;
  rt::time_point at_{};
  std::uint64_t bytes_ = 0;
};

// Until a signal, the end of --duration, or a disk that takes no more.
exit_code run(asked_robot& robot, recorder& into, topics_of_robot& topics, const record_settings& o,
              const console& to) {
  missing_publishers missing{robot.hub(), robot.connection(), names_in(o.words), to};
  const auto begin = rt::monotonic_clock::now();
  const auto end = rt::deadline_after(begin, o.duration.value_or(rt::for_ever));
  const bool looks = o.words.empty() || std::ranges::any_of(o.words, is_pattern);
  auto next_look = begin;
  bool warned = false;
  bool named = false;
  std::string path;
  std::string fault;
  recording_progress_line line{o.quiet};
  while (!interrupt::seen() && rt::monotonic_clock::now() < end) {
    const auto now = rt::monotonic_clock::now();
    if (now >= next_look) {
      next_look = now + topics_period;
      const bool told = topics.look();
      if (!std::exchange(named, true)) topics.subscribe_named(); // what is there already has a type
      if (!told && looks && robot.hub().peers() != 0 && !std::exchange(warned, true)) {
        to.error("it does not say which topics it has: name those to be recorded");
      }
    }
    const recording_figures figures = into.figures();
    if (figures.path != path) {
      path = figures.path;
      to.note("recording into ", printable(path));
    }
    if (figures.fault != fault) {
      fault = figures.fault;
      if (!fault.empty()) to.error(printable(fault), o.total.empty() ? "" : "; trying again");
      if (!fault.empty() && o.total.empty()) return exit_code::failed;
    }
    line.show(figures, now);
    robot.connection().report();
    missing.report();
    interrupt::sleep_until(std::min({end, next_look, now + interrupt::slice}));
  }
  return exit_code::done;
}

// The parameters of the robot's program as they are when the recording begins.
recording_metadata parameters_of(service_asker& robot) {
  recording_metadata all;
  const auto names = names_of(robot, name_kind::parameter);
  if (!names) return all;
  for (const auto& [name, type] : *names) {
    if (name.starts_with("/rowe/") || all.size() == parameters_max) continue;
    const auto got = robot.ask("/rosapi/get_param", joined(R"({"name":)", json_string_of(name), "}"));
    if (!got) break; // nor will it say the others
    all.emplace(name, plain_text_of(read_json(*got).find("value").value_or(json_value{})));
  }
  return all;
}

exit_code record_from(asked_robot& robot, const record_settings& o, recording_options file,
                      const console& to) {
  if (const auto stats = robot.ask("/rowe/stats")) {
    if (const auto name = read_json(*stats).get<std::string>("name")) file.name = *name;
  }
  file.metadata = parameters_of(robot.services());
  if (interrupt::seen()) return exit_code::interrupted;
  std::string why;
  auto made = robot.hub().record({.file = file, .topics = o.words, .exclude = o.exclude}, &why);
  if (!made) {
    struct stat there {};
    const bool is_there = ::stat(o.to.c_str(), &there) == 0 && S_ISREG(there.st_mode);
    to.error(why.empty() ? made.error().message() : printable(why),
             is_there ? "; -o names another file, or a folder" : "");
    return exit_code::failed;
  }
  recorder into = std::move(*made);
  for (const std::string& one : into.unended())
    to.note(printable(one), " was not ended by its program; `rowe record --repair` does it");
  topics_of_robot topics{robot.services(), into, o, to}; // with the types, until the recorder is closed
  exit_code end = run(robot, into, topics, o, to);
  const bool whole = static_cast<bool>(into.close(&why));
  if (!whole && end == exit_code::done) {
    to.error(printable(why));
    end = exit_code::failed;
  }
  const recording_figures figures = into.figures();
  to.note(counted(figures.messages, "message"), ", ", bytes_text(figures.bytes), " in ",
          counted(figures.files, "file"), figures.lost == 0 ? "" : joined(", lost ", figures.lost));
  return end == exit_code::done && figures.lost != 0 ? exit_code::lost : end;
}

} // namespace

exit_code record(argument_list arguments) {
  record_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"record"};
  to.be_quiet(chosen.quiet);
  if (chosen.repair && chosen.snapshot)
    return usage_error("record", "--repair and --snapshot exclude each other");
  if (chosen.repair) return repair_recordings(chosen.words, to);
  if (!chosen.cause.empty() && !chosen.snapshot) return usage_error("record", "--cause is for --snapshot");
  if (chosen.snapshot && !chosen.words.empty())
    return usage_error("record", "--snapshot takes no TOPIC: a black box has its own");
  if (chosen.snapshot)
    return ask_for_snapshot(chosen.at, chosen.cause, chosen.timeout.value_or(answer_time), to);
  recording_options file;
  if (const std::string wrong = read_file_options(chosen, file); !wrong.empty())
    return usage_error("record", wrong);
  auto bounds = limits_for("record");
  if (!bounds) return exit_code::usage;
  bounds->handles_max = std::max(bounds->handles_max, recorded_topics_max + 64);
  bounds->topics_max = std::max(bounds->topics_max, recorded_topics_max + 64);
  bounds->subscriptions_max = std::max(bounds->subscriptions_max, recorded_topics_max + 64);
  asked_robot robot{"record", answer_time, to};
  if (const auto end = robot.connect(chosen.at, chosen.timeout, bounds)) return *end;
  return record_from(robot, chosen, std::move(file), to);
}

} // namespace rowe::tools
