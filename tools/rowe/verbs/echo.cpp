// SPDX-License-Identifier: Apache-2.0
// rowe echo: prints the messages of topics, or plain messages, as they come.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/asked_robot.hpp"
#include "../network/missing_publishers.hpp"
#include "../network/remote.hpp"
#include "../network/robot_names.hpp"
#include "../network/subscriptions.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/json_values.hpp"
#include "../text/message_format.hpp"
#include "../text/page.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t short_bytes_max = limits{}.message_bytes_max;
constexpr std::uint32_t plain_depth = 512;
constexpr std::size_t long_bytes_max = 64 * 1024 * 1024; // of as many messages as are waited for
constexpr rt::duration drain_time = 250ms;
constexpr rt::duration list_timeout = 2s;

struct echo_options {
  remote_place at;
  std::vector<std::string> topics;
  bool plain = false;
  bool pretty = false;
  bool json = false;
  bool csv = false;
  std::string field;
  bool once = false;
  std::int64_t count = 0; // 0: no end
  std::optional<rt::duration> timeout;
  std::optional<double> hertz; // nothing: all messages
  std::size_t profile = 0;
  bool quiet = false;
  bool takes_long = false;
  std::uint32_t text_bytes_max = short_bytes_max;

  message_format::kind format() const noexcept {
    return json ? message_format::kind::json : csv ? message_format::kind::csv : message_format::kind::pretty;
  }
  // Hop's programs know no topics.
  bool asks_publishers() const { return !plain && profile_of(profile) == websocket_profile::standard; }
  subscriptions_wanted wanted() const {
    return {.topics = topics,
            .text_bytes_max = text_bytes_max,
            .throttle = hertz ? throttle_of(*hertz) : rt::duration{}};
  }
};

command table_of(echo_options& o) {
  return {
      .verb = "echo",
      .examples = {{{"rowe echo ws://127.0.0.1:8080 /odom", "until Ctrl-C"},
                    {"rowe echo 127.0.0.1:8080", "the topics there are"}}},
      .description =
          "Prints the bodies of the topics' messages, each followed by a line `---`. With several topics\n"
          "each message names its topic; with --json it is {\"topic\":NAME,\"msg\":BODY} then. Without a\n"
          "topic it prints the topics there are, with their types. It ends at once (4) when --timeout\n"
          "passes without a message, and with 1 when a message has no such --field. Topics below /rowe/\n"
          "are the server's.\n"
          "\n"
          "Messages may have 60 KiB; with --long, --once or a small -n they may have 1 MiB, or what\n"
          "ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX says, up to 64 MiB. The longer they may be, the fewer\n"
          "are buffered for a slow reader of the output.\n",
      .operands = {url_operand(o.at.url),
                   {.name = "TOPIC",
                    .meaning = "their names, such as /odom; without any they are listed",
                    .into = &o.topics,
                    .optional = true,
                    .left_out = &o.plain}},
      .options = with_remote(
          o.at,
          {
              {"--pretty", "", "", "for people: indented (the default)", &o.pretty},
              {"--json", "", "", "the JSON text as it came, one message a line", &o.json},
              {"--csv", "", "", "a header, then a row for each message; of one topic", &o.csv},
              {"--field", "", "PATH", "only this part, such as pose.x or ranges[0]", &o.field},
              {"-n", "", "N", "end after this many messages", integer{&o.count, 1, INT64_MAX}},
              {"--once", "", "", "end after one message", &o.once},
              {"--hz", "", "N",
               "at most as many messages of a topic a second: the robot leaves out the others",
               rate{&o.hertz, 1000}},
              {"--timeout", "", "TIME", "for the connection and for each message (default: until Ctrl-C)",
               time_span{&o.timeout}},
              {"--long", "", "", "also long messages, such as maps", &o.takes_long},
              {"--plain", "", "", "plain messages in place of a topic's", &o.plain},
              profile_option(o.profile),
              {"--quiet", "-q", "", "print errors only on stderr", &o.quiet},
          })};
}

// What is wrong with the options together; empty when nothing is.
std::string contradiction(const echo_options& o) {
  if (o.once && o.count > 1) return "--once and -n exclude each other";
  if (o.pretty + o.json + o.csv > 1) return "--pretty, --json and --csv exclude each other";
  if (!o.plain && o.topics.empty() && (o.csv || o.pretty || o.once || o.count > 0 || !o.field.empty()))
    return "a TOPIC is missing; without one the topics are listed, as text or with --json";
  const auto field = json_value{}.get<json_value>(o.field);
  if (!field && field.code() == errc::bad_argument)
    return joined("--field: ", printable(field.error().message()));
  if (o.csv && o.topics.size() > 1)
    return joined("--csv makes a table of one topic, not of ", o.topics.size());
  if (o.topics.size() > subscriptions::topics_max)
    return joined(o.topics.size(), " topics are too many: at most ", subscriptions::topics_max);
  if (o.hertz && o.plain) return "--hz is for topics, which --plain messages have none of";
  return {};
}

// Plain messages. A call among them is printed as well, and refused: nobody here has an answer.
class plain_messages {
 public:
  static std::optional<plain_messages> open(endpoint& hub, const subscriptions_wanted&, const console& to,
                                            exit_code& otherwise) {
    auto opened = hub.open_lane(
        {.depth = 16, .inbox_depth = plain_depth, .calls = 1, .text_bytes_max = limits{}.message_bytes_max});
    if (!opened) {
      to.error("cannot receive: ", opened.error().message());
      otherwise = exit_code_of(opened.error());
      return std::nullopt;
    }
    return plain_messages{std::move(*opened)};
  }

  result<incoming> take(rt::duration timeout) {
    auto taken = from_.receive(timeout);
    if (!taken) return taken.error();
    if (taken->wants_reply()) {
      // If it cannot be sent the peer has to wait for its own time-out.
      (void)from_.try_refuse(*taken, "rowe echo only listens", rt::monotonic_clock::now());
    }
    return incoming{{}, std::move(*taken)};
  }

 private:
  explicit plain_messages(lane from) noexcept : from_{std::move(from)} {}

  lane from_;
};

template <class Source>
class printer {
 public:
  printer(Source from, missing_publishers& missing, remote& hub, const echo_options& chosen,
          const console& to)
      : from_{std::move(from)},
        missing_{missing},
        hub_{hub},
        chosen_{chosen},
        to_{to},
        format_{chosen.format(), chosen.field, chosen.topics.size() > 1} {}

  exit_code run() {
    while (chosen_.count == 0 || printed_ < chosen_.count) {
      if (const auto end = wait()) return *end;
      const auto text = format_.text_of(taken_->topic, taken_->body.json());
      if (!text) {
        const auto at = taken_->body.template get<json_value>(chosen_.field);
        to_.error(printable(at.error().message()));
        return exit_code::failed;
      }
      taken_.reset();
      if (!emit(*text)) {
        unread_ = true;
        break;
      }
      ++printed_;
    }
    return exit_code::done;
  }

  std::int64_t printed() const noexcept { return printed_; }
  std::size_t odd_rows() const noexcept { return format_.odd_rows(); }
  // There is no use in going on: the reader of our output has what it wanted, or it cannot be written.
  bool unread() const noexcept { return unread_; }

 private:
  // Waits for the next message. Nothing: it is in taken_.
  std::optional<exit_code> wait() {
    const auto end = rt::deadline_after(rt::monotonic_clock::now(), chosen_.timeout.value_or(rt::for_ever));
    for (;;) {
      if (interrupt::seen()) return printed_ > 0 ? exit_code::done : exit_code::interrupted;
      const auto now = rt::monotonic_clock::now();
      auto message = from_.take(std::min<rt::duration>(interrupt::slice, end - std::min(now, end)));
      hub_.report();
      missing_.report();
      if (message) {
        taken_.emplace(std::move(*message));
        return std::nullopt;
      }
      if (message.code() != errc::timed_out) {
        to_.error(message.error().message());
        return exit_code::failed;
      }
      if (rt::monotonic_clock::now() >= end) {
        to_.error("no ", what(), " within ", seconds_text(*chosen_.timeout));
        return exit_code::timed_out;
      }
    }
  }

  std::string what() const {
    if (chosen_.plain) return "plain message";
    std::string text = "message on ";
    for (const std::string& topic : chosen_.topics) {
      text.append(&topic == &chosen_.topics.front() ? "" : " or ").append(printable(topic));
    }
    return text;
  }

  Source from_;
  missing_publishers& missing_;
  remote& hub_;
  const echo_options& chosen_;
  const console& to_;
  message_format format_;
  std::optional<incoming> taken_;
  std::int64_t printed_ = 0;
  bool unread_ = false;
};

// The topics there are, by name and type.
exit_code list_topics(const echo_options& o, const console& to) {
  asked_robot robot{"echo", o.timeout.value_or(list_timeout), to};
  if (const auto end = robot.connect(o.at, o.timeout)) return *end;
  if (o.json) {
    const auto answer = robot.ask("/rosapi/topics");
    if (!answer) return robot.give_up("what topics it has");
    emit(on_one_line(*answer));
  } else {
    const auto all = names_of(robot.services(), name_kind::topic);
    if (!all) return robot.give_up("what topics it has");
    text_table table{{{"TOPIC"}, {"TYPE"}}};
    for (const robot_name& one : *all)
      table.add({printable(one.name), one.type.empty() ? "-" : printable(one.type)});
    emit(table.text(columns_of_stdout()));
  }
  to.note("rowe echo ", robot.url(), " TOPIC prints the messages of one");
  return exit_code::done;
}

template <class Source>
exit_code print_from(endpoint hub, const std::string& url, const echo_options& o, const console& to) {
  exit_code otherwise = exit_code::failed;
  auto source = Source::open(hub, o.wanted(), to, otherwise);
  if (!source) return otherwise;
  remote connection{hub, url, to};
  if (const auto end = connection.wait(o.timeout)) return *end;
  missing_publishers missing{hub, connection, o.asks_publishers() ? o.topics : std::vector<std::string>{},
                             to};
  printer<Source> printing{std::move(*source), missing, connection, o, to};
  const exit_code end = printing.run();
  const std::uint64_t lost = lost_here(hub); // what comes from here on is for nobody
  (void)hub.close(drain_time); // for the refusals of calls; a peer that does not read in that time gets none
  if (printing.unread() && !output_failed()) return exit_code::done;
  if (printing.odd_rows() > 0)
    to.note(counted(printing.odd_rows(), "message"), " had other members than the table");
  if (interrupt::seen() || lost > 0 || output_failed())
    to.note(counted(printing.printed(), "message"), lost == 0 ? std::string{} : joined(", lost ", lost));
  if (lost > 0 && !o.plain && !o.takes_long)
    to.note("with --long, messages of more than ", short_bytes_max, " bytes are printed, too");
  if (lost > 0 && end == exit_code::done) return exit_code::lost;
  return end;
}

} // namespace

exit_code echo(argument_list arguments) {
  echo_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"echo"};
  to.be_quiet(chosen.quiet);
  if (const std::string wrong = contradiction(chosen); !wrong.empty()) return usage_error("echo", wrong);
  if (chosen.once) chosen.count = 1;
  if (!chosen.plain && chosen.topics.empty()) return list_topics(chosen, to);
  auto bounds = limits_for("echo");
  if (!bounds) return exit_code::usage;
  const std::uint32_t longest = std::max(short_bytes_max, bounds->long_message_bytes_max);
  // So few are kept, however fast they come.
  const auto wanted = static_cast<std::uint64_t>(chosen.count);
  if (wanted != 0 && wanted <= long_bytes_max / longest) chosen.takes_long = true;
  if (!chosen.plain && chosen.takes_long) chosen.text_bytes_max = longest;
  bounds->handle_bytes = std::max(bounds->handle_bytes, subscriptions::bytes_for(chosen.wanted()));
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("echo", chosen.at, {.limits = *bounds, .profile = profile_of(chosen.profile)},
                              to, otherwise);
  if (!opened) return otherwise;
  return chosen.plain ? print_from<plain_messages>(std::move(opened->hub), opened->url, chosen, to)
                      : print_from<subscriptions>(std::move(opened->hub), opened->url, chosen, to);
}

} // namespace rowe::tools
