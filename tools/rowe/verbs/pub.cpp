// SPDX-License-Identifier: Apache-2.0
// rowe pub: publishes one message or many, on a topic or as plain messages. Deadlines are absolute, so a rate
// does not drift. Every message is sent: where there is no room, or no connection for a while, it waits, but
// no longer than its time to live.
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../text/json_values.hpp"
#include "../text/message_source.hpp"
#include "delivery.hpp"
#include "sending.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t queue_depth = 64;
constexpr std::uint32_t short_bytes_max = limits{}.message_bytes_max;
// Where messages may be long, fewer of them are queued: as many as fit here, but two at least.
constexpr std::size_t queue_bytes = 32 * 1024 * 1024;
// What --stamp adds to a message, at most.
constexpr std::size_t stamp_bytes_max = 128;
// How long the server may take to say what it thinks of the messages, and how long it may take to read a
// second's share of the longest.
constexpr rt::duration answer_time = 1s;
constexpr std::size_t bytes_per_second = 1024 * 1024;
// How often it is asked whether somebody has subscribed.
constexpr rt::duration subscriber_period = 100ms;

struct pub_options {
  remote_place at;
  std::string topic;
  std::string json;
  std::optional<double> rate;
  std::int64_t count = 0; // 0: as many as there are
  bool once = false;
  std::optional<rt::duration> ttl;
  bool stamp = false;
  std::string type;
  bool latch = false;
  bool plain = false;
  bool wait = false;
  std::optional<rt::duration> timeout;
  std::size_t profile = 0;
  bool quiet = false;
  std::uint32_t longest = short_bytes_max; // that may be sent

  bool from_stdin() const noexcept { return json == "-"; }
  bool from_file() const noexcept { return json.starts_with('@'); }
  // What a message may have, in the queue.
  std::uint32_t text_bytes_max() const noexcept {
    if (from_stdin()) return longest;
    const std::size_t wanted = json.size() + (stamp ? stamp_bytes_max : 0);
    return static_cast<std::uint32_t>(std::clamp<std::size_t>(wanted, short_bytes_max, longest));
  }
  std::uint32_t depth() const noexcept {
    if (text_bytes_max() <= short_bytes_max) return queue_depth;
    return std::clamp(static_cast<std::uint32_t>(queue_bytes / text_bytes_max()), 2U, queue_depth);
  }
};

command table_of(pub_options& o) {
  return {
      .verb = "pub",
      .examples = {{{"rowe pub ws://127.0.0.1:8080 /chatter '{\"data\":\"hello\"}'", "once"},
                    {"rowe pub 127.0.0.1 /cmd_vel '{\"linear\":{\"x\":0.1}}' -r 10Hz --ttl 50ms",
                     "until Ctrl-C"}}},
      .description =
          "Publishes a JSON object on a topic: once, or with -r again and again; with - each line of stdin\n"
          "is one, with @FILE the whole file. (Lines that have times are played at their own pace by\n"
          "`rowe replay`.) With --plain it is sent as a plain message. The summary is on\n"
          "stderr. If the server reports that a subscriber there cannot decode a message, it exits with 1. "
          "If\n"
          "a message was not sent within its time to live, or was dropped, it exits with 6. If nobody has\n"
          "subscribed to the topic, it says so; with -w it waits for somebody first.\n"
          "\n"
          "A topic's message may have 1 MiB, or what ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX says, up to 64 MiB:\n"
          "so many bytes the server must allow, too (rowe serve --limit long_message_bytes_max=67108864). A\n"
          "plain message may have 60 KiB.\n",
      .operands = {url_operand(o.at.url),
                   {.name = "TOPIC",
                    .meaning = "its name, such as /chatter; none with --plain",
                    .into = &o.topic,
                    .left_out = &o.plain},
                   {.name = "JSON|@FILE|-",
                    .meaning = "the message, or @map.json for that file, or - for the lines of stdin",
                    .into = &o.json}},
      .options = with_remote(
          o.at,
          {
              {"--rate", "-r", "HZ", "publish at this rate (10Hz, 1kHz); without -n until Ctrl-C",
               rate{&o.rate, rate_max}},
              {"-n", "", "N", "end after this many messages", integer{&o.count, 1, INT64_MAX}},
              {"--once", "", "", "end after one message", &o.once},
              {"--ttl", "", "TIME",
               "an older message is not sent; for a plain message this includes waiting for the connection",
               time_span{&o.ttl}},
              {"--stamp", "", "", "set header.stamp to the time of sending", &o.stamp},
              {"--type", "", "TYPE", "the topic's type, such as std_msgs/String", &o.type},
              {"--latch", "", "", "late subscribers get the last message; stay for them until Ctrl-C",
               &o.latch},
              {"--plain", "", "", "a plain message in place of a topic's", &o.plain},
              {"--wait", "-w", "", "wait until somebody has subscribed to the topic", &o.wait},
              {"--timeout", "", "TIME",
               "how long to wait for the connection, and for a subscriber (default: until Ctrl-C)",
               time_span{&o.timeout}},
              profile_option(o.profile),
              {"--quiet", "-q", "", "print errors only", &o.quiet},
          })};
}

// How to raise the limit on a message's length.
std::string_view remedy(const pub_options& o) noexcept {
  return o.plain ? " as a plain message" : " (ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX raises that)";
}

// Reads the file that is named in place of the message. Returns what is wrong, if anything.
std::string read_file(pub_options& o) {
  const std::string name = o.json.substr(1);
  std::ifstream from{name, std::ios::binary};
  if (!from) return joined("cannot read ", quoted(name), ": ", std::strerror(errno));
  // No more than that it is too long needs to be known.
  std::string text(std::size_t{o.longest} + 1, '\0');
  from.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (from.bad()) return joined("cannot read ", quoted(name), ": ", std::strerror(errno));
  text.resize(static_cast<std::size_t>(from.gcount()));
  if (text.size() > o.longest) {
    return joined(quoted(name), " has more than the ", o.longest, " bytes that can be sent", remedy(o));
  }
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  o.json = std::move(text);
  return {};
}

// What is wrong with the options together; empty when nothing is. `named`: what the message is called.
std::string contradiction(const pub_options& o, std::string_view named) {
  if (o.once && o.count > 1) return "--once and -n exclude each other";
  if (o.once && o.rate) return "--once and -r exclude each other";
  if (o.plain && o.latch) return "--latch is for topics, not for plain messages";
  if (o.plain && !o.type.empty()) return "--type is for topics, not for plain messages";
  if (o.plain && o.wait) return "--wait is for topics, not for plain messages";
  if (o.wait && profile_of(o.profile) != websocket_profile::standard)
    return "--wait is for the profile standard: Hop programs have no subscribers";
  if (o.plain && o.ttl && o.timeout) {
    return "--timeout and --ttl exclude each other: the time to live of a plain message includes waiting for "
           "the connection";
  }
  if (o.from_stdin()) return {};
  if (const auto fault = object_fault(o.json); !fault.empty()) return joined(named, " ", fault);
  if (const std::size_t bytes = o.json.size() + (o.stamp ? stamp_bytes_max : 0); bytes > o.longest)
    return joined("the message has ", o.json.size(), " bytes, at most ", o.longest, " can be sent",
                  remedy(o));
  if (o.stamp && !stamped(o.json, {})) return "--stamp needs a message whose `header` is an object";
  return {};
}

rt::duration answer_time_for(std::size_t bytes) noexcept {
  return answer_time + std::chrono::seconds{bytes / bytes_per_second};
}

rt::duration since_1970() noexcept {
  timespec wall;
  ::clock_gettime(CLOCK_REALTIME, &wall);
  return std::chrono::seconds{wall.tv_sec} + std::chrono::nanoseconds{wall.tv_nsec};
}

// Publishes on a topic. What is not written in time is counted by the endpoint.
class on_topic {
 public:
  static result<on_topic> open(endpoint& hub, const pub_options& o) {
    auto topic = hub.advertise<json_text>(o.topic, {.ttl = o.ttl.value_or(rt::for_ever),
                                                    .keep = keep::all,
                                                    .depth = o.depth(),
                                                    .latched = o.latch,
                                                    .type = o.type,
                                                    .text_bytes_max = o.text_bytes_max()});
    if (!topic) return topic.error();
    return on_topic{std::move(*topic)};
  }
  status send(std::string_view json, watcher&) noexcept { return to_.publish(json); }

  // Waits until the server has dealt with all that was published, and has said what was wrong with it.
  // Nothing answers a publish, so it is asked who has subscribed; see has_subscribers().
  result<bool> handled(endpoint& hub, const pub_options& o, std::size_t longest_sent, watcher& wait) {
    // What several handles have is written side by side, so the call is opened when this one is done with:
    // that waits until its values are written. Another one keeps the topic advertised, and so its last
    // message.
    result<publisher<json_text>> keeps = errc::misuse;
    if (o.latch) keeps = hub.advertise<json_text>(o.topic, {.depth = 1, .latched = true, .type = o.type});
    to_ = {};
    const auto answer = has_subscribers(hub, o.topic, answer_time_for(longest_sent), wait);
    if (keeps) to_ = std::move(*keeps);
    return answer;
  }

 private:
  explicit on_topic(publisher<json_text> to) noexcept : to_{std::move(to)} {}

  publisher<json_text> to_;
};

// Sends plain messages, and waits until each has left.
class plain_messages {
 public:
  static result<plain_messages> open(endpoint& hub, const pub_options& o) {
    auto opened = hub.open_lane(
        {.depth = 4, .inbox_depth = 1, .calls = 4, .text_bytes_max = short_bytes_max, .receive = false});
    if (!opened) return opened.error();
    return plain_messages{std::move(*opened), o.ttl.value_or(rt::for_ever)};
  }
  status send(std::string_view json, watcher& wait) {
    return wait.during([&] { return to_.send(json, ttl_); });
  }

 private:
  plain_messages(lane to, rt::duration ttl) noexcept : to_{std::move(to)}, ttl_{ttl} {}

  lane to_;
  rt::duration ttl_;
};

template <class Target>
class sender {
 public:
  sender(Target target, remote& hub, const pub_options& chosen, const console& to)
      : target_{std::move(target)}, hub_{hub}, waits_{hub}, chosen_{chosen}, to_{to} {}

  // Sends all there is. Nothing: to its end.
  std::optional<exit_code> run() {
    const std::int64_t ordinary = chosen_.rate || chosen_.from_stdin() ? INT64_MAX : 1;
    const std::int64_t count = chosen_.once ? 1 : chosen_.count > 0 ? chosen_.count : ordinary;
    const auto begin = rt::monotonic_clock::now();
    for (std::int64_t i = 0; i < count; ++i) {
      if (chosen_.rate) interrupt::sleep_until(begin + period_times(i));
      if (interrupt::seen()) return exit_code::interrupted;
      if (chosen_.from_stdin()) {
        if (const auto end = read_line()) return *end == exit_code::done ? std::nullopt : end;
      }
      if (const auto end = send(chosen_.from_stdin() ? line_ : chosen_.json)) return end;
    }
    return std::nullopt;
  }

  // What the other side says behind all that was sent: as has_subscribers(). Nothing: it was not asked.
  std::optional<result<bool>> handled(endpoint& via) {
    if constexpr (is_topic) {
      if (profile_of(chosen_.profile) == websocket_profile::standard && via.peers() != 0)
        return target_.handled(via, chosen_, longest_sent_, waits_);
    }
    return std::nullopt;
  }

  // Before anything is sent: waits for a subscriber where that is asked for, and says that there is none
  // where nobody knows when the end will come. Nothing: go on. Otherwise the verb ends so. Who subscribes to
  // one message is gone behind it, so it is asked here whether there is somebody.
  std::optional<exit_code> meet(endpoint& via, bool endless) {
    if (!is_topic || !(chosen_.wait || !to_.quiet()) ||
        profile_of(chosen_.profile) != websocket_profile::standard)
      return std::nullopt;
    const auto begin = rt::monotonic_clock::now();
    const auto end = rt::deadline_after(begin, chosen_.timeout.value_or(rt::for_ever));
    for (bool told = false;; told = true) {
      const auto somebody = has_subscribers(via, chosen_.topic, answer_time, waits_);
      hub_.report();
      if (interrupt::seen()) return exit_code::interrupted;
      if (somebody && *somebody) {
        met_ = true;
        return std::nullopt;
      }
      if (!chosen_.wait) {
        met_ = !somebody; // who knows
        if (somebody && endless) to_.note("nobody has subscribed to ", printable(chosen_.topic), " yet");
        return std::nullopt;
      }
      if (!somebody && is_answer(somebody)) {
        to_.error("the server does not say who has subscribed to ", printable(chosen_.topic));
        return exit_code::failed;
      }
      if (rt::monotonic_clock::now() >= end) {
        to_.error("nobody has subscribed to ", printable(chosen_.topic), " within ",
                  seconds_text(*chosen_.timeout));
        return exit_code::timed_out;
      }
      if (!told)
        to_.note("waits until somebody has subscribed to ", printable(chosen_.topic), " (Ctrl-C to stop)");
      interrupt::sleep_until(std::min(end, rt::monotonic_clock::now() + subscriber_period));
    }
  }

  std::uint64_t sent() const noexcept { return sent_; }
  std::uint64_t expired() const noexcept { return expired_; }
  bool met() const noexcept { return met_; }
  std::size_t longest_sent() const noexcept { return longest_sent_; }

 private:
  static constexpr bool is_topic = std::is_same_v<Target, on_topic>;

  rt::duration period_times(std::int64_t i) const noexcept {
    return rt::duration{static_cast<std::int64_t>(static_cast<double>(i) * 1e9 / *chosen_.rate)};
  }

  // Reads the next line that is not blank. Nothing: it is in line_. `done`: there are no more.
  std::optional<exit_code> read_line() {
    for (;;) {
      const auto outcome = lines_.read(line_, rt::monotonic_clock::now() + interrupt::slice);
      hub_.report();
      if (interrupt::seen()) return exit_code::interrupted;
      if (outcome == line_reader::outcome::end) return exit_code::done;
      if (outcome == line_reader::outcome::too_long) {
        to_.error("line ", lines_.number(), " of stdin is longer than ", chosen_.longest, " bytes",
                  remedy(chosen_));
        return exit_code::failed;
      }
      if (outcome == line_reader::outcome::line && line_.find_first_not_of(" \t") != line_.npos) break;
    }
    const std::string fault = object_fault(line_);
    if (fault.empty() && (!chosen_.stamp || stamped(line_, {}))) return std::nullopt;
    to_.error("line ", lines_.number(), " of stdin ",
              fault.empty() ? "has a `header` that is no object, which --stamp needs" : fault);
    return exit_code::failed;
  }

  // Sends one message, whatever it takes. Nothing: it was sent, or has expired and was counted.
  std::optional<exit_code> send(const std::string& json) {
    for (;;) {
      if (interrupt::seen()) return exit_code::interrupted;
      const status done =
          target_.send(chosen_.stamp ? stamped(json, since_1970()).value_or(json) : json, waits_);
      hub_.report();
      if (done) {
        ++sent_;
        longest_sent_ = std::max(longest_sent_, json.size());
        return std::nullopt;
      }
      if (interrupt::seen()) return exit_code::interrupted;
      if (done.code() == errc::expired) {
        ++expired_;
        return std::nullopt;
      }
      if (done.code() == errc::full) {
        interrupt::sleep_until(rt::monotonic_clock::now() + room_period);
      } else if (done.code() == errc::no_peer) {
        if (const auto end = hub_.wait(chosen_.timeout)) return end;
      } else {
        to_.error(done.error().message());
        // An argument to blame is one that object_fault() cannot know of.
        const bool reserved = done.code() == errc::reserved_member && !chosen_.from_stdin();
        return reserved ? exit_code::usage : exit_code::failed;
      }
    }
  }

  Target target_;
  remote& hub_;
  watcher waits_;
  const pub_options& chosen_;
  const console& to_;
  line_reader lines_{chosen_.longest};
  std::string line_;
  std::uint64_t sent_ = 0;
  std::size_t longest_sent_ = 0;
  std::uint64_t expired_ = 0; // that the target told us of
  bool met_ = false;          // somebody had, or may have, subscribed before anything was sent
};

// What is the verdict once `lost` of the messages were, and the server has reported errors?
exit_code verdict(std::optional<exit_code> end, std::uint64_t sent, std::uint64_t lost,
                  std::uint64_t errors_reported, bool endless) noexcept {
  if (end && *end != exit_code::interrupted) return *end;
  if (errors_reported > 0) return exit_code::failed;
  if (lost > 0) return exit_code::lost;
  // The one way that what is endless ends.
  if (end && !(endless && sent > 0)) return exit_code::interrupted;
  return exit_code::done;
}

// Says of the server's answer behind all that was sent what is worth knowing.
// `refused`: it has said already that it refused something. `met`: somebody had subscribed before.
void tell(const result<bool>& answer, bool refused, bool met, std::size_t longest_sent, const pub_options& o,
          const console& to) {
  if (answer && !*answer && !o.latch && !refused && !met) {
    to.note("nobody has subscribed to ", printable(o.topic), ": only the server got it");
  } else if (answer.code() == errc::timed_out) {
    to.note("the server did not answer within ", seconds_text(answer_time_for(longest_sent)),
            ", so whether it took all is not known");
  } else if (!is_answer(answer) && !refused) {
    to.note("the connection ended before the server had answered, so whether it took all is not known");
  }
}

template <class Target>
exit_code send_to(endpoint hub, const std::string& url, const pub_options& o, const console& to) {
  auto target = Target::open(hub, o);
  if (!target) {
    to.error("cannot publish", o.plain ? "" : joined(" on ", quoted(o.topic)), ": ",
             target.error().message());
    return exit_code_of(target.error());
  }
  remote connection{hub, url, to};
  if (!(o.plain && o.ttl)) {
    if (const auto end = connection.wait(o.timeout)) return *end;
  }
  sender<Target> sending{std::move(*target), connection, o, to};
  const bool endless = (o.rate || o.from_stdin()) && !o.once && o.count == 0;
  if (const auto end = sending.meet(hub, endless)) return *end;
  const auto begin = rt::monotonic_clock::now();
  const auto end = sending.run();
  bool cut_off = false; // the connection ended before the server had dealt with everything
  if (sending.sent() != 0 && !interrupt::seen()) {
    const auto handled = sending.handled(hub);
    connection.report();
    cut_off = handled && !is_answer(*handled) && handled->code() != errc::timed_out;
    if (handled && !interrupt::seen())
      tell(*handled, connection.errors_reported() != 0, sending.met(), sending.longest_sent(), o, to);
  }
  // A status says it, in words of which older servers have only these.
  const bool kept = connection.error_reported().find("for late subscribers") == std::string::npos;
  if (o.latch && kept && !connection.topic_refused() && !end && !interrupt::seen()) {
    to.note("the last message is retained for late subscribers (Ctrl-C to stop)");
    while (!interrupt::seen()) {
      interrupt::sleep_until(rt::monotonic_clock::now() + interrupt::slice);
      connection.report();
    }
  }
  connection.report();
  const status drained = hub.close(o.timeout.value_or(drain_time));
  const auto elapsed = rt::monotonic_clock::now() - begin;
  if (!drained) to.error("at the end: ", drained.error().message());

  // The endpoint tells of plain messages one by one.
  const std::uint64_t lost = o.plain ? sending.expired() : std::min(lost_here(hub), sending.sent());
  const std::uint64_t sent = sending.sent() - (o.plain ? 0 : lost);
  if (const std::string refused = refusal_of(url, sending.longest_sent(), connection.error_reported());
      !refused.empty()) {
    to.error(refused);
  } else if (!o.plain && (lost != 0 || cut_off) && sending.longest_sent() > short_bytes_max) {
    to.note("the longest message has ", sending.longest_sent(),
            " bytes, which the server must allow: its limit long_message_bytes_max is 1 MiB by default");
  }
  const std::uint64_t errors = connection.errors_reported();
  to.note("sent ", counted(sent, "message"), " in ", seconds_text(elapsed),
          lost == 0 ? std::string{} : joined(", not sent ", lost),
          errors == 0                  ? ""
          : connection.topic_refused() ? "; the server refused the topic"
                                       : "; the server reported errors");
  if (!drained && !end) return exit_code::lost;
  return verdict(end, sent, lost, errors, endless);
}

} // namespace

exit_code pub(argument_list arguments) {
  pub_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"pub"};
  to.be_quiet(chosen.quiet);
  auto bounds = limits_for("pub");
  if (!bounds) return exit_code::usage;
  if (!chosen.plain) chosen.longest = std::max(short_bytes_max, bounds->long_message_bytes_max);
  const std::string named = quoted(chosen.from_file() ? chosen.json.substr(1) : chosen.json);
  if (chosen.from_file()) {
    if (const std::string wrong = read_file(chosen); !wrong.empty()) return usage_error("pub", wrong);
  }
  if (const std::string wrong = contradiction(chosen, named); !wrong.empty())
    return usage_error("pub", wrong);
  bounds->handle_bytes =
      std::max(bounds->handle_bytes, chosen.depth() * (chosen.text_bytes_max() + std::size_t{1024}) +
                                         std::size_t{64} * (short_bytes_max + 1024));
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("pub", chosen.at, {.limits = *bounds, .profile = profile_of(chosen.profile)},
                              to, otherwise);
  if (!opened) return otherwise;
  return chosen.plain ? send_to<plain_messages>(std::move(opened->hub), opened->url, chosen, to)
                      : send_to<on_topic>(std::move(opened->hub), opened->url, chosen, to);
}

} // namespace rowe::tools
