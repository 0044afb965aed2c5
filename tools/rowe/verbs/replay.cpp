// SPDX-License-Identifier: Apache-2.0
// rowe replay: publishes what was recorded, at its own pace. What the file is, its first bytes say.
#include <cmath>
#include <optional>
#include <string>

#include "../arguments/command_line.hpp"
#include "../arguments/values.hpp"
#include "../console.hpp"
#include "replaying.hpp"
#include "sending.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

constexpr double factor_max = 1000;

command table_of(replay_options& o) {
  return {
      .verb = "replay",
      .examples = {{{"rowe replay ws://127.0.0.1:8080 run.mcap --from 1:30 --rate 0.5",
                     "a recording, at half its pace"},
                    {"rowe replay ws://127.0.0.1:8080 path.txt --topic /odom --rate 1kHz --loop",
                     "a trajectory, for ever"}}},
      .description =
          "Publishes what a file has, each message at its time and all in their order. FILE is one of:\n"
          "  a recording (MCAP) with messages in JSON\n"
          "  lines as `rowe echo --json` prints them: {\"topic\":NAME,\"msg\":BODY}, each with a member\n"
          "  \"time\" (seconds since 1970, or in ISO 8601), or with --rate HZ; with --topic lines are "
          "bodies\n"
          "  a TUM trajectory (`time tx ty tz qx qy qz qw` a line), published as nav_msgs/Odometry\n"
          "\n"
          "What cannot be played is named and counted: topics below /rowe/, which are the endpoint's own,\n"
          "other encodings, damaged parts, and messages that are longer than 1 MiB or what\n"
          "ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX says. The summary on stderr says how late messages were.\n"
          "\n"
          "On a terminal: space pauses and goes on, s or the right arrow takes one message while it pauses,\n"
          "[ and ] or the arrows go back and forward by 5 s, q ends.\n"
          "\n"
          "It exits with 1 if parts of the file could not be read, with 6 if messages were not sent, and\n"
          "with 130 if it is interrupted before its end, unless --loop was given.\n",
      .operands = {url_operand(o.at.url),
                   {.name = "FILE", .meaning = "what was recorded", .into = &o.file, .instead = &o.tum}},
      .options = with_remote(
          o.at,
          {
              {"--rate", "", "FACTOR|HZ",
               "0.5 or 2x of the recorded pace; for what has no times, and for trajectories, 250Hz or 2kHz",
               &o.rate},
              {"--loop", "", "", "begin again at the end", &o.loop},
              {"--from", "", "TIME", "from there: 90s or 1:30; -10s from the end; 2026-11-30T04:10:00Z",
               &o.from},
              {"--to", "", "TIME", "until there, likewise", &o.to},
              {"--topics", "", "PATTERN",
               "only these, such as /odom,/arm/*; ** is for any number of levels (repeatable)",
               &o.wishes.only},
              {"--exclude", "", "PATTERN", "not these (repeatable)", &o.wishes.without},
              {"--remap", "", "FROM:=TO", "publish a topic under another name (repeatable)",
               &o.wishes.remaps},
              {"--topic", "", "NAME", "where to publish a trajectory, or lines that are bodies", &o.topic},
              {"--tum", "", "FILE", "the FILE, which is a TUM trajectory in any case", &o.tum},
              {"--ttl", "", "TIME", "an older message is not sent", time_span{&o.ttl}},
              {"--timeout", "", "TIME", "how long to wait for the connection (default: until Ctrl-C)",
               time_span{&o.timeout}},
              {"--quiet", "-q", "", "print errors only", &o.quiet},
          })};
}

} // namespace

std::optional<rate_wish> rate_wish_of(std::string_view text, std::string& wrong) {
  rate_wish wish;
  if (text.empty()) return wish;
  const bool is_factor = text.ends_with('x') || text.ends_with('X');
  const auto number = rate_of(is_factor ? text.substr(0, text.size() - 1) : text);
  const bool has_unit = text.ends_with('z');
  if (!number || (is_factor && text.find_first_not_of("0123456789.") != text.size() - 1)) {
    wrong = joined("--rate needs a factor such as 0.5 or 2x, or a rate such as 250Hz, not ", quoted(text));
    return std::nullopt;
  }
  if (is_factor && (*number > factor_max || *number < 1 / factor_max)) {
    wrong = joined("--rate ", printable(text), " is out of range: 0.001x to 1000x");
    return std::nullopt;
  }
  if (!is_factor && *number > rate_max) {
    wrong = joined("--rate ", printable(text), " is out of range: at most ", std::lround(rate_max), " Hz");
    return std::nullopt;
  }
  (is_factor ? wish.factor : has_unit ? wish.hz : wish.plain) = *number;
  return wish;
}

exit_code replay(argument_list arguments) {
  replay_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"replay"};
  to.be_quiet(chosen.quiet);
  std::string why;
  const auto pace = rate_wish_of(chosen.rate, why);
  if (!pace) return usage_error("replay", why);
  if (!chosen.tum.empty()) return replay_trajectory(chosen, *pace, to);
  if (const spelled_url url = read_url(chosen.at.url); url.url.empty())
    return usage_error("replay", url.wrong);
  const auto kind = kind_of_file(chosen.file, why);
  if (!kind) {
    std::string other;
    const bool swapped = reads_like_url(chosen.file) && kind_of_file(chosen.at.url, other);
    to.error(why, swapped ? "; the URL stands in front of the FILE" : "");
    return exit_code::failed;
  }
  if (*kind == kept_as::trajectory) return replay_trajectory(chosen, *pace, to);
  return replay_messages(chosen, *pace, *kind, to);
}

} // namespace rowe::tools
