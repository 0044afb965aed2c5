// SPDX-License-Identifier: Apache-2.0
// rowe hz, bw and delay: subscribes to topics, and says each second what came.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/recording.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../measures/topic_window.hpp"
#include "../network/missing_publishers.hpp"
#include "../network/remote.hpp"
#include "../network/subscriptions.hpp"
#include "../output.hpp"
#include "../text/amounts.hpp"
#include "../text/json_values.hpp"
#include "../text/times.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

enum class measured : std::uint8_t { rates, bytes, ages };

struct rates_options {
  measured what{};
  remote_place at;
  std::vector<std::string> topics;
  std::string field; // of the message's own time
  std::optional<rt::duration> every;
  std::optional<rt::duration> timeout;
  std::int64_t count = 0; // of reports; 0: no end
  bool once = false;
  bool takes_long = false;
  bool json = false;
  bool quiet = false;

  rt::duration period() const { return every.value_or(1s); }
  subscriptions_wanted wanted() const {
    return {.topics = topics,
            .text_bytes_max = takes_long ? limits{}.long_message_bytes_max : limits{}.message_bytes_max,
            .depth = 1024};
  }
};

command rates_table(rates_options& o, std::string_view verb, std::array<example, 2> examples,
                    std::string_view description) {
  std::vector<option> own{
      {"--every", "", "TIME", "how often it says so (default 1s)", time_span{&o.every}},
      {"-n", "", "N", "end after this many reports (exit code 4: no message came)",
       integer{&o.count, 1, INT64_MAX}},
      {"--once", "", "", "end after one report", &o.once},
      {"--json", "", "", "one JSON object a line for each topic and report", &o.json},
      {"--long", "", "", "also long messages, such as maps", &o.takes_long},
      {"--timeout", "", "TIME", "for the connection (default: until Ctrl-C)", time_span{&o.timeout}},
      {"--quiet", "-q", "", "print errors only on stderr", &o.quiet}};
  if (o.what == measured::ages)
    own.insert(own.begin(),
               {"--field", "", "PATH", "where the message has its time (default header.stamp)", &o.field});
  return {.verb = verb,
          .examples = examples,
          .description = description,
          .operands = {url_operand(o.at.url),
                       {.name = "TOPIC", .meaning = "their names, such as /odom", .into = &o.topics}},
          .options = with_remote(o.at, std::move(own))};
}

// Seconds since 1970 as ROS 1 and ROS 2 write them, as a number, or as a text of ISO 8601.
std::optional<std::int64_t> time_in(json_value value) {
  constexpr std::int64_t seconds_max = 9'000'000'000; // the year 2255
  const auto member = [&](std::string_view name) { return value.get<std::int64_t>(name); };
  for (const auto& [seconds, rest] : {std::pair{"sec", "nanosec"}, std::pair{"secs", "nsecs"}}) {
    const auto s = member(seconds);
    const auto ns = member(rest);
    if (!s || !ns) continue;
    if (*s < 0 || *s > seconds_max || *ns < 0 || *ns >= 1'000'000'000) return std::nullopt;
    return *s * 1'000'000'000 + *ns;
  }
  if (const auto number = value.get<double>("")) {
    // Seconds, milliseconds, microseconds or nanoseconds since 1970, by their size: from 1970 on to 2255.
    for (const double unit_ns : {1e9, 1e6, 1e3, 1.0}) {
      const double ns = *number * unit_ns;
      if (ns >= 0 && ns <= static_cast<double>(seconds_max) * 1e9) return std::llround(ns);
    }
    return std::nullopt;
  }
  if (value.kind() == json_kind::string) return iso_time_of(plain_text_of(value));
  return std::nullopt;
}

// "1.25 ms".
std::string short_time(rt::duration time) {
  const auto ns = static_cast<double>(time.count());
  const double size = std::abs(ns);
  if (size < 1e3) return joined(time.count(), " ns");
  if (size < 1e6) return joined(decimal_text(ns / 1e3, 1), " us");
  if (size < 1e9) return joined(decimal_text(ns / 1e6, 2), " ms");
  return joined(decimal_text(ns / 1e9, 3), " s");
}

std::string spread_text(const topic_window::spread& of) {
  return joined("min ", short_time(of.least), ", p50 ", short_time(of.median), ", p99 ", short_time(of.p99),
                ", max ", short_time(of.most));
}

std::string spread_json(std::string_view name, const std::optional<topic_window::spread>& of) {
  if (!of) return joined(",\"", name, "\":null");
  return joined(",\"", name, R"(":{"min":)", of->least.count(), R"(,"p50":)", of->median.count(),
                R"(,"p99":)", of->p99.count(), R"(,"max":)", of->most.count(), "}");
}

class rates {
 public:
  rates(const rates_options& chosen, const console& to) : chosen_{chosen}, to_{to} {
    for (const std::string& topic : chosen.topics) windows_.push_back({topic, {}});
  }

  exit_code run(endpoint& hub, remote& connection, subscriptions from) {
    missing_publishers missing{hub, connection, chosen_.topics, to_};
    const auto begin = rt::monotonic_clock::now();
    auto next = begin + chosen_.period();
    std::int64_t reports = 0;
    std::uint64_t lost = 0;
    while (!interrupt::seen() && (chosen_.count == 0 || reports < chosen_.count)) {
      const auto now = rt::monotonic_clock::now();
      if (now >= next) {
        const std::uint64_t lost_before = std::exchange(lost, lost_of(hub));
        if (!report(now - (next - chosen_.period()), lost - lost_before)) return exit_code::done;
        ++reports;
        next = now + chosen_.period();
        continue;
      }
      auto taken = from.take(std::min<rt::duration>(interrupt::slice, next - now));
      connection.report();
      missing.report();
      if (!taken && taken.code() != errc::timed_out) {
        to_.error(taken.error().message());
        return exit_code::failed;
      }
      if (taken && !add(*taken)) return exit_code::failed;
    }
    if (interrupt::seen() && reports == 0) return exit_code::interrupted;
    return chosen_.count != 0 && !any_ ? exit_code::timed_out : exit_code::done;
  }

 private:
  struct one_topic {
    std::string name;
    topic_window window;
  };

  static std::uint64_t lost_of(const endpoint& hub) {
    std::uint64_t lost = 0;
    for (const count& one : hub.counts())
      if (one.group == "loss" && (one.name == "inbox_full" || one.name == "no_slot")) lost += one.value;
    return lost;
  }

  // False: the message has no time.
  bool add(const incoming& came) {
    const auto found = std::ranges::find(windows_, came.topic, &one_topic::name);
    std::optional<rt::duration> age;
    if (chosen_.what == measured::ages) {
      const std::string& path = chosen_.field;
      const auto value = came.body.get<json_value>(path);
      const auto sent_ns = value ? time_in(*value) : std::nullopt;
      if (!sent_ns) {
        to_.error("a message of ", quoted(found->name), " has no time at ", quoted(path),
                  ": a time of ROS, seconds since 1970 or ISO 8601; --field says where it is");
        return false;
      }
      const auto waited = rt::monotonic_clock::now() - came.body.arrived();
      age = rt::duration{wall_clock_ns() - *sent_ns} - waited;
    }
    any_ = true;
    found->window.add(came.body.arrived(), came.body.json().text().size(), age);
    return true;
  }

  // False: nobody reads our output any more.
  bool report(rt::duration over, std::uint64_t lost) {
    std::string text;
    for (one_topic& one : windows_) {
      text += chosen_.json ? json_of(one, over) : text_of(one, over);
      one.window.clear();
    }
    if (lost != 0)
      to_.note(counted(lost, "message"), " came faster than they could be taken, and are missing");
    return emit(text);
  }

  std::string text_of(const one_topic& one, rt::duration over) const {
    const topic_window& window = one.window;
    const std::string name = printable(one.name);
    if (window.messages() == 0) return joined(name, ": no message within ", short_time(over), "\n");
    const double seconds = std::chrono::duration<double>(over).count();
    switch (chosen_.what) {
    case measured::rates: {
      const auto hertz = window.hertz();
      if (!hertz) return joined(name, ": 1 message\n");
      const int decimals = *hertz >= 1000 ? 0 : *hertz >= 10 ? 1 : 3;
      return joined(name, ": ", decimal_text(*hertz, decimals), " Hz, gaps ", spread_text(*window.gaps()),
                    "\n");
    }
    case measured::bytes: {
      const double rate = static_cast<double>(window.bytes()) / seconds;
      return joined(name, ": ", bytes_text(static_cast<std::uint64_t>(rate)), "/s, ",
                    counted(window.messages(), "message"), " of ",
                    bytes_text(window.bytes() / window.messages()), " on average\n");
    }
    case measured::ages: break;
    }
    return joined(name, ": ", spread_text(*window.ages()), ", ", counted(window.messages(), "message"), "\n");
  }

  std::string json_of(const one_topic& one, rt::duration over) const {
    const topic_window& window = one.window;
    const auto hertz = window.hertz();
    std::string text =
        joined(R"({"topic":)", json_string_of(one.name), R"(,"over_ns":)", over.count(), R"(,"messages":)",
               window.messages(), R"(,"bytes":)", window.bytes(), R"(,"rate_hz":)",
               hertz ? decimal_text(*hertz, 3) : "null", spread_json("gap_ns", window.gaps()));
    if (chosen_.what == measured::ages) text += spread_json("delay_ns", window.ages());
    return text + "}\n";
  }

  const rates_options& chosen_;
  const console& to_;
  std::vector<one_topic> windows_;
  bool any_ = false; // a message has come
};

exit_code measure(argument_list arguments, rates_options& o, const command& table) {
  if (const auto end = read(table, arguments)) return *end;
  console to{table.verb};
  to.be_quiet(o.quiet);
  if (o.once && o.count > 1) return usage_error(table.verb, "--once and -n exclude each other");
  if (o.once) o.count = 1;
  if (o.field.empty()) o.field = "header.stamp";
  if (o.topics.size() > subscriptions::topics_max)
    return usage_error(table.verb,
                       joined(o.topics.size(), " topics are too many: at most ", subscriptions::topics_max));
  for (std::string& topic : o.topics)
    if (!topic.starts_with('/')) topic.insert(0, 1, '/');
  std::vector<std::string> once;
  for (std::string& topic : o.topics)
    if (std::ranges::find(once, topic) == once.end()) once.push_back(std::move(topic));
  o.topics = std::move(once);
  auto bounds = limits_for(table.verb);
  if (!bounds) return exit_code::usage;
  bounds->handle_bytes = std::max(bounds->handle_bytes, subscriptions::bytes_for(o.wanted()));
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint(table.verb, o.at, {.limits = *bounds}, to, otherwise);
  if (!opened) return otherwise;
  auto from = subscriptions::open(opened->hub, o.wanted(), to, otherwise);
  if (!from) return otherwise;
  remote connection{opened->hub, opened->url, to};
  if (const auto end = connection.wait(o.timeout)) return *end;
  return rates{o, to}.run(opened->hub, connection, std::move(*from));
}

} // namespace

exit_code hz(argument_list arguments) {
  rates_options chosen{
      .what = measured::rates, .at = {}, .topics = {}, .field = {}, .every = {}, .timeout = {}};
  return measure(
      arguments, chosen,
      rates_table(chosen, "hz",
                  {{{"rowe hz ws://127.0.0.1:8080 /odom", "a line each second, until Ctrl-C"},
                    {"rowe hz 127.0.0.1:8080 /odom /scan --once --json", "for scripts"}}},
                  "Says how often messages of topics arrive, and the gaps between them: the "
                  "shortest, the\nmedian, the 99th percentile and the longest. They are taken when "
                  "they arrive here.\n"));
}

exit_code bw(argument_list arguments) {
  rates_options chosen{
      .what = measured::bytes, .at = {}, .topics = {}, .field = {}, .every = {}, .timeout = {}};
  return measure(arguments, chosen,
                 rates_table(chosen, "bw",
                             {{{"rowe bw ws://127.0.0.1:8080 /odom", "a line each second, until Ctrl-C"},
                               {"rowe bw 127.0.0.1:8080 /odom /scan --every 10s", "an average of 10 s"}}},
                             "Says how many bytes a second the messages of topics have: their JSON, without "
                             "what frames\nand TLS add.\n"));
}

exit_code delay(argument_list arguments) {
  rates_options chosen{
      .what = measured::ages, .at = {}, .topics = {}, .field = {}, .every = {}, .timeout = {}};
  return measure(
      arguments, chosen,
      rates_table(chosen, "delay",
                  {{{"rowe delay ws://127.0.0.1:8080 /odom", "by its header.stamp"},
                    {"rowe delay 127.0.0.1:8080 /imu --field time", "by another member"}}},
                  "Says how old messages are when they arrive: the time here, less the time that "
                  "the message\nhas. So both clocks must agree; where they do not, ages may be below "
                  "0. The time is one of ROS\n({\"sec\":..,\"nanosec\":..}), a number of seconds, "
                  "milliseconds or nanoseconds since 1970, or ISO\n8601.\n"));
}

} // namespace rowe::tools
