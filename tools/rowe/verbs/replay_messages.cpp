// SPDX-License-Identifier: Apache-2.0
// rowe replay of recorded messages: what is chosen of the file, the endpoint for it, and the summary.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <rowe/endpoint.hpp>
#include <rowe/rt/thread.hpp>

#include "../arguments/limit_options.hpp"
#include "../interrupt.hpp"
#include "../recordings/player.hpp"
#include "../recordings/reading_progress.hpp"
#include "../recordings/time_range.hpp"
#include "../status_line.hpp"
#include "../text/times.hpp"
#include "delivery.hpp"
#include "replaying.hpp"
#include "sending.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t short_text_bytes_max = limits{}.message_bytes_max;
constexpr rt::duration server_answer_time = 1s; // for what it thinks of long messages

// The file, and what of it is played.
struct chosen_part {
  std::unique_ptr<recorded_messages> file;
  play_plan plan;
  read_ahead::range range;
  player_options playing;
  std::uint32_t longest = 0; // bytes that may be sent
};

// The part of the file between --from and --to. Empty: it is set.
std::string set_range(const replay_options& o, chosen_part& part) {
  const recorded_messages& file = *part.file;
  std::string wrong;
  const auto range = time_range_of(o.from, o.to, file, wrong);
  if (!range) return wrong;
  part.range.from_ns = part.playing.from_ns = range->from_ns;
  part.playing.to_ns = range->to_ns;
  part.range.until_ns = range->until_ns;
  // A step of mean length lies between the last message and the first one of the next lap.
  const auto steps = static_cast<std::int64_t>(std::max<std::uint64_t>(file.messages(), 2) - 1);
  const std::int64_t step = range->to_the_end ? (file.end_ns() - file.begin_ns()) / steps : 0;
  part.playing.lap_ns = range->to_ns - range->from_ns + step;
  return {};
}

// Opens the file. Nothing: the verb ends with `end`, and the reason was printed.
std::unique_ptr<recorded_messages> open_kept(const replay_options& o, const rate_wish& pace, kept_as kind,
                                             const console& to) {
  std::string why;
  std::unique_ptr<recorded_messages> file;
  {
    reading_progress progress{o.file, to.quiet()};
    const auto show = [&](double part) { progress(part); };
    file = kind == kept_as::recording ? open_recording(o.file, why, show)
                                      : open_lines(o.file, {.topic = o.topic, .rate_hz = pace.hz}, why, show);
  }
  if (file && file->messages() == 0) {
    why = joined(printable(o.file), ": there is no message in it");
    file.reset();
  }
  if (!file) to.error(why);
  return file;
}

// Nothing: the file is read, and its part chosen. Otherwise the verb ends so.
std::optional<exit_code> choose(const replay_options& o, const rate_wish& pace, kept_as kind,
                                const console& to, chosen_part& part) {
  if (kind == kept_as::recording && !o.topic.empty())
    return usage_error("replay",
                       "--topic is for trajectories and lines; --topics chooses among a recording's");
  if (kind == kept_as::recording && pace.hz)
    return usage_error("replay", joined("--rate ", printable(o.rate),
                                        ": a recording has times of its own; a factor such as 2x fits"));
  part.file = open_kept(o, pace, kind, to);
  if (!part.file) return interrupt::seen() ? exit_code::interrupted : exit_code::failed;
  std::string wrong = set_range(o, part);
  if (wrong.empty()) {
    auto plan = plan_for(part.file->topics(), o.wishes, wrong);
    if (plan) part.plan = std::move(*plan);
  }
  if (wrong.empty() && o.loop && part.playing.lap_ns <= 0)
    wrong = "what has no duration has no pace to --loop at";
  if (!wrong.empty()) return usage_error("replay", wrong);
  part.playing.rate = pace.factor ? *pace.factor : pace.plain.value_or(1);
  part.playing.timeout = o.timeout;
  part.range.topics = part.plan.selected;
  part.range.loop = o.loop;
  for (const std::string& one : part.plan.not_played) to.note(one);
  if (!part.plan.topics.empty()) return std::nullopt;
  to.error(printable(o.file), ": there is nothing to play in it");
  return exit_code::failed;
}

std::string milliseconds_text(rt::duration time) {
  return joined(decimal_text(static_cast<double>(time.count()) / 1e6, 2), " ms");
}

// "skipped 3: /map 2 too long, /x 1 no JSON object".
std::string skipped_text(const player_figures& of, const std::vector<recorded_topic>& topics) {
  std::uint64_t all = 0;
  std::string text;
  const auto add = [&](const auto& counts, std::string_view why) {
    for (const auto& [topic, count] : counts) {
      all += count;
      text.append(joined(text.empty() ? ": " : ", ", printable(topics[topic].name), " ", count, " ", why));
    }
  };
  add(of.too_long, "too long");
  add(of.no_object, "no JSON object");
  return all == 0 ? "" : joined(", skipped ", all, text);
}

// Long messages may be refused only once they have arrived: waits for the server's answer to a question
// behind them.
void hear_of_long_ones(endpoint& hub, ordered_topics& topics, const player_figures& of, remote& connection) {
  if (of.longest_sent <= short_text_bytes_max || interrupt::seen()) return;
  const auto end = rt::monotonic_clock::now() + server_answer_time;
  while (!topics.all_left() && rt::monotonic_clock::now() < end && !interrupt::seen()) {
  }
  watcher waits{connection};
  (void)has_subscribers(hub, of.longest_on, server_answer_time, waits); // any answer does
}

exit_code verdict_of(std::optional<exit_code> end, const replay_options& o, const player_figures& of,
                     std::uint64_t errors, bool lost) {
  const bool looped = o.loop && end == exit_code::interrupted && of.published > 0; // the way a loop ends
  if (end && !looped) return *end;
  if (errors > 0 || of.faults > 0) return exit_code::failed;
  return lost || !of.too_long.empty() || !of.no_object.empty() ? exit_code::lost : exit_code::done;
}

exit_code play_part(endpoint hub, const std::string& url, chosen_part& part, const replay_options& o,
                    const console& to) {
  std::string wrong;
  auto topics = ordered_topics::open(hub, part.plan.topics,
                                     {.ttl = o.ttl.value_or(rt::for_ever), .longest = part.longest}, wrong);
  if (!topics) {
    to.error("cannot publish on ", quoted(wrong), ": ", topics.error().message());
    return exit_code_of(topics.error());
  }
  remote connection{hub, url, to};
  if (const auto end = connection.wait(o.timeout)) return *end;

  (void)rt::prepare_this_thread({.name = "rowe replay"}); // it wakes as exactly as the kernel can
  const auto begin = rt::monotonic_clock::now();
  keys keyboard{!to.quiet() || status_line::is_possible()};
  read_ahead ahead{*part.file, part.range};
  player playing{*topics, part.plan, part.file->topics(), ahead, connection, keyboard, part.playing, to};
  const auto end = playing.play();
  const player_figures& of = playing.figures();
  hear_of_long_ones(hub, *topics, of, connection);
  connection.report();
  const status drained = hub.close(o.timeout.value_or(drain_time));
  const auto elapsed = rt::monotonic_clock::now() - begin;
  const std::uint64_t lost = std::min(lost_here(hub), of.published);
  status_line::clear();
  if (!drained) to.error("at the end: ", drained.error().message());
  if (const std::string refused = refusal_of(url, of.longest_sent, connection.error_reported());
      !refused.empty())
    to.error(printable(of.longest_on), ": ", refused);

  const rt::histogram& late = playing.lateness();
  to.note("published ", counted(of.published - lost, "message"), " in ", seconds_text(elapsed),
          of.laps == 0 ? "" : joined(" and ", counted(of.laps, "whole lap")),
          lost == 0 ? "" : joined(", not sent ", lost), skipped_text(of, part.file->topics()),
          of.faults == 0 ? "" : joined(", ", counted(of.faults, "part"), " could not be read"),
          late.count() == 0
              ? ""
              : joined("; late p50 ", milliseconds_text(late.percentile(50)), ", p99 ",
                       milliseconds_text(late.percentile(99)), ", max ", milliseconds_text((late.max)())),
          connection.errors_reported() == 0 ? "" : "; the server reported errors");
  return verdict_of(end, o, of, connection.errors_reported(), lost != 0 || !drained);
}

} // namespace

exit_code replay_messages(const replay_options& o, const rate_wish& pace, kept_as kind, const console& to) {
  auto bounds = limits_for("replay");
  if (!bounds) return exit_code::usage;
  chosen_part part;
  if (const auto end = choose(o, pace, kind, to, part)) return *end;

  const std::size_t count = part.plan.topics.size();
  part.longest = std::max(short_text_bytes_max, bounds->long_message_bytes_max);
  const std::size_t longest = std::min<std::size_t>(part.longest, part.file->message_bytes_max());
  bounds->handle_bytes = std::max(bounds->handle_bytes, ordered_topics::handle_bytes_for(count, longest));
  constexpr std::uint32_t others = 16; // topics and handles besides those that are played
  bounds->topics_max = std::max(bounds->topics_max, static_cast<std::uint32_t>(count) + others);
  bounds->handles_max = std::max(bounds->handles_max, 2 * static_cast<std::uint32_t>(count) + others);
  // A message goes when it is due, not when the service thread looks next.
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("replay", o.at, {.idle_policy = idle::wake, .limits = *bounds}, to, otherwise);
  if (!opened) return otherwise;
  return play_part(std::move(opened->hub), opened->url, part, o, to);
}

} // namespace rowe::tools
