// SPDX-License-Identifier: Apache-2.0
// rowe echo: prints the messages of a topic as they come.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>

#include "command_line.hpp"
#include "console.hpp"
#include "interrupt.hpp"
#include "json_outline.hpp"
#include "remote.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

// Between the socket and us: room for a burst while the reader of our output is slow. 512 bodies of the
// largest size that a peer may send are 30 MiB.
constexpr std::uint32_t queue_depth = 512;

struct echo_options {
  std::string url;
  std::string topic;
  bool json = false;
  bool once = false;
  std::int64_t count = 0; // 0: no end
  std::optional<rt::duration> timeout;
  bool quiet = false;
};

command table_of(echo_options& o) {
  return {
      .verb = "echo",
      .examples = {{{"rowe echo ws://127.0.0.1:8080 /odom", "until Ctrl-C"},
                    {"rowe echo 127.0.0.1:8080 /odom --json -n 100 --timeout 2s | jq .pose.pose.position",
                     ""}}},
      .description =
          "Prints the bodies of a topic's messages, each followed by a line `---`; with --json as they\n"
          "came, one a line. It ends at once (4) when --timeout passes without a message.\n",
      .operands = {{"URL", "ws://HOST[:PORT][/PATH] or HOST:PORT (default $ROWE_URL)", &o.url, "ROWE_URL"},
                   {"TOPIC", "its name, such as /odom", &o.topic}},
      .options = {
          {"--json", "", "", "the JSON text as it came, one message a line", &o.json},
          {"-n", "", "N", "end after so many messages", integer{&o.count, 1, INT64_MAX}},
          {"--once", "", "", "end after one message", &o.once},
          {"--timeout", "", "TIME", "for the connection and for each message (default: until Ctrl-C)",
           time_span{&o.timeout}},
          {"--quiet", "-q", "", "print errors only on stderr", &o.quiet},
      }};
}

// A body on one line: the line breaks that JSON allows between its tokens become blanks. (Inside strings it
// has none.)
std::string on_one_line(std::string_view json) {
  std::string line{json};
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line += '\n';
}

class printer {
 public:
  printer(subscriber<json_text> from, remote& hub, const echo_options& chosen, const console& to)
      : from_{std::move(from)}, hub_{hub}, chosen_{chosen}, to_{to} {}

  exit_code run() {
    while (chosen_.count == 0 || printed_ < chosen_.count) {
      if (const auto end = wait()) return *end;
      const std::string_view body = taken_->text();
      if (!emit(chosen_.json ? on_one_line(body) : joined(outline_of(body), "---\n"))) {
        unread_ = true;
        break;
      }
      taken_.reset();
      ++printed_;
    }
    return exit_code::done;
  }

  std::int64_t printed() const noexcept { return printed_; }
  // The reader of our output has gone: it has what it wanted.
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
      if (message) {
        taken_.emplace(std::move(*message));
        return std::nullopt;
      }
      if (message.code() != errc::timed_out) {
        to_.error(sentence_of(message.error()));
        return exit_code::failed;
      }
      if (rt::monotonic_clock::now() >= end) {
        to_.error("no message on ", printable(chosen_.topic), " within ", seconds_text(*chosen_.timeout));
        return exit_code::timed_out;
      }
    }
  }

  subscriber<json_text> from_;
  remote& hub_;
  const echo_options& chosen_;
  const console& to_;
  std::optional<message_view> taken_;
  std::int64_t printed_ = 0;
  bool unread_ = false;
};

exit_code print_from(endpoint hub, const std::string& url, std::uint32_t text_bytes_max,
                     const echo_options& o, const console& to) {
  auto topic = hub.subscribe<json_text>(o.topic, {.depth = queue_depth, .text_bytes_max = text_bytes_max});
  if (!topic) {
    to.error("cannot subscribe to ", quoted(o.topic), ": ", sentence_of(topic.error()));
    return exit_code_of(topic.error());
  }
  remote connection{hub, url, to};
  if (const auto end = connection.wait(o.timeout)) return *end;
  printer printing{std::move(topic).value(), connection, o, to};
  const exit_code end = printing.run();
  if (printing.unread()) return exit_code::done;
  const std::uint64_t lost = lost_here(hub);
  if (interrupt::seen() || lost > 0) to.note(printing.printed(), " messages, lost ", lost);
  if (lost > 0 && end == exit_code::done) return exit_code::lost;
  return end;
}

} // namespace

exit_code echo(argument_list arguments) {
  echo_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"echo"};
  to.be_quiet(chosen.quiet);
  if (chosen.once && chosen.count > 1) return usage_error("echo", "--once and -n exclude each other");
  if (chosen.once) chosen.count = 1;
  const spelled_url url = read_url(chosen.url);
  if (url.url.empty()) return usage_error("echo", url.wrong);

  endpoint_options options;
  const std::uint32_t text_bytes_max = options.limits.message_bytes_max;
  options.limits.lane_bytes = (std::size_t{queue_depth} + 64) * (text_bytes_max + 1024);
  auto hub = endpoint::connect(url.url, options);
  if (!hub) {
    to.error(printable(url.url), ": ", sentence_of(hub.error()));
    return exit_code_of(hub.error());
  }
  return print_from(std::move(hub).value(), url.url, text_bytes_max, chosen, to);
}

} // namespace rowe::tools
