// SPDX-License-Identifier: Apache-2.0
// rowe stop: asks a robot to stop, and says whether its loops acknowledged it: one sentence on stdout, and an
// exit code that means the same.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../output.hpp"
#include "../text/json_values.hpp"
#include "stop_report.hpp"
#include "stop_ways.hpp"
#include "stop_words.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration timeout_default = 1s;
constexpr rt::duration connect_time_min = 1s;  // connecting takes what it takes, however little --timeout is
constexpr rt::duration words_time_min = 500ms; // for the robot's name and its state, after the stop
constexpr std::size_t said_bytes_max = 250;    // of its source, and of its reason

struct stop_settings {
  remote_place at;
  std::string source;
  std::string reason;
  std::optional<rt::duration> timeout;
  std::int64_t repeat = 0; // 0: one stop, told in one sentence
  std::optional<rt::duration> max;
  bool json = false;
  bool quiet = false;
};

command table_of(stop_settings& o) {
  return {
      .verb = "stop",
      .examples = {{{"rowe stop ws://10.0.0.7:8080", "the robot stops, and stays so until `rowe reset`"},
                    {"rowe stop 10.0.0.7:8080 --repeat 1000 --max 5ms",
                     "how long its answer takes, for CI"}}},
      .description =
          "Stops all loops of a robot and says whether they acknowledged it (0). 1: they did not, or it has\n"
          "no stop. 3: it was not reached. 4: it did not answer in time. 5: an answer took longer than "
          "--max.\n"
          "With --repeat it asks again and never resets, so all requests but the first find it stopped.\n"
          "A software stop, not a safety-rated emergency stop.\n",
      .operands = {url_operand(o.at.url)},
      .options = with_remote(
          o.at,
          {
              {"--source", "", "S", "who stops it, as everyone sees it (default: our address)", &o.source},
              {"--reason", "", "R", "why it is stopped, for the robot's events", &o.reason},
              {"--timeout", "", "TIME",
               "how long to wait for each answer (default 1s), and 1s at least to connect",
               time_span{&o.timeout}},
              {"--repeat", "", "N", "ask this many times, one after another",
               integer{&o.repeat, 1, INT64_MAX}},
              {"--max", "", "TIME", "the longest time that an answer may take", time_span{&o.max}},
              {"--json", "", "", "one JSON object, times in nanoseconds", &o.json},
              {"--quiet", "-q", "", "no hints on stderr", &o.quiet},
          })};
}

// The beginning, which is all that robots show: no text may be too long for the stop that it comes with.
std::string_view beginning_of(std::string_view text) {
  std::size_t bytes = std::min(text.size(), said_bytes_max);
  const auto continues = [&] { return (static_cast<unsigned char>(text[bytes]) & 0xc0) == 0x80; };
  while (bytes != 0 && bytes < text.size() && continues()) --bytes; // between characters
  return text.substr(0, bytes);
}

// Whatever bytes these are, it is JSON that fits.
std::string request_of(const stop_settings& o) {
  constexpr std::size_t escaped = 6; // bytes of one, at most
  static_assert(2 * escaped * said_bytes_max + 64 <= stop_way::text_bytes_max);
  message_of<stop_way::text_bytes_max> request;
  if (!o.source.empty()) request.add("source", beginning_of(o.source));
  if (!o.reason.empty()) request.add("reason", beginning_of(o.reason));
  return std::string{request.text()};
}

using service = stop_way::service;

// `why`: what else went wrong.
stop_outcome stop_once(service& by, watcher& waits, const std::string& request, rt::duration timeout,
                       std::string& why) {
  rt::time_point asked, answered;
  const auto reply = waits.during([&] {
    asked = rt::monotonic_clock::now();
    auto got = by.call(request, timeout);
    answered = rt::monotonic_clock::now();
    return got;
  });
  using end = stop_outcome::end;
  if (reply) return stop_outcome::of_answer(reply->value(), asked, answered);
  switch (reply.code()) {
  case errc::timed_out: return {.how = end::timed_out};
  case errc::no_service:
  case errc::refused: return {.how = end::no_stop};
  case errc::no_peer:
  case errc::peer_lost: return {.how = end::lost};
  default: why = reply.error().message(); return {.how = end::failed};
  }
}

exit_code stop_by(stop_ways& robot, const stop_settings& o, const std::string& url, const console& to) {
  stop_story story{.url = url, .limit = o.timeout.value_or(timeout_default)};
  const rt::duration connect_time = std::max(story.limit, connect_time_min);
  const rt::duration words_time = std::max(o.timeout.value_or(words_time_min), words_time_min);
  const std::string request = request_of(o);

  stop_tally all;
  stop_outcome last;
  const auto begin = rt::monotonic_clock::now();
  const auto answer_of = [&](stop_way& by, std::optional<service>& from) {
    if (!from) return std::string{"{}"};
    const auto answer = by.waits.during([&] { return from->call("{}", words_time); });
    return answer ? std::string{answer->value()} : std::string{"{}"};
  };

  auto ended = robot.connect(connect_time);
  if (ended == exit_code::no_connection) {
    last = {.how = stop_outcome::end::unreachable, .took = rt::monotonic_clock::now() - begin};
    all.count(last, {});
  }
  std::string said; // the same failure again and again is told once
  for (std::int64_t left = std::max<std::int64_t>(o.repeat, 1); left > 0 && !ended; --left) {
    if (interrupt::seen()) break;
    stop_way& by = robot.way();
    const stop_outcome now = stop_once(*by.stopping, by.waits, request, story.limit, story.more);
    if (!now.answered() && interrupt::seen()) break; // given up
    by.connection.report();
    // A place that is kept goes to the next one after a moment, perhaps before the stop was read.
    if (now.how == stop_outcome::end::lost && robot.on_kept_place() &&
        rt::monotonic_clock::now() - begin < connect_time && !robot.connect(connect_time)) {
      ++left;
      continue;
    }
    robot.drop_other();
    last = now;
    all.count(last, o.max);
    if (last.how == stop_outcome::end::acknowledged) continue;
    if (last.how == stop_outcome::end::accepted) story.more = late_loops(answer_of(by, by.stating));
    if (o.repeat > 0) {
      const std::string text = sentence_of(last, story);
      if (text != said) to.error(text);
      said = text;
    }
    if (last.how == stop_outcome::end::lost && left > 1) ended = robot.connect(connect_time);
  }
  if (all.empty()) return exit_code::interrupted;

  if (last.answered())
    story.robot = printable(text_member(answer_of(robot.way(), robot.way().stats), "name"));
  const std::string& who = story.robot.empty() ? url : story.robot;
  if (o.repeat > 0) {
    emit(o.json ? all.json(story.robot) : all.line(who));
  } else {
    emit(o.json ? json_of(last, story) : sentence_of(last, story) + '\n');
  }
  if (const std::string beyond = all.beyond(); !beyond.empty()) to.error(beyond);
  if (last.number)
    to.note("it stays stopped; to reset it: rowe reset ", url, " ", *last.number, typed_again(o.at));
  if (last.how != stop_outcome::end::acknowledged) to.note("if it moves, use its wired emergency stop");
  return all.verdict();
}

} // namespace

exit_code stop(argument_list arguments) {
  stop_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"stop"};
  to.be_quiet(chosen.quiet);
  const spelled_url url = read_url(chosen.at.url);
  if (url.url.empty()) return usage_error("stop", url.wrong);
  const auto bounds = limits_for("stop", std::size_t{8} * limits{}.message_bytes_max);
  if (!bounds) return exit_code::usage;
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(chosen.at, options, to)) return *end;
  stop_ways robot{url.url, options, to};
  if (const auto end = robot.open()) return *end;
  return stop_by(robot, chosen, url.url, to);
}

} // namespace rowe::tools
