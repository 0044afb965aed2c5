// SPDX-License-Identifier: Apache-2.0
// rowe call: asks a service and prints its answer; or asks it again and again and tells how long that took.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>
#include <rowe/rt/histogram.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../network/robot_names.hpp"
#include "../output.hpp"
#include "../text/json_outline.hpp"
#include "../text/json_values.hpp"
#include "../text/message_format.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t text_bytes_max = limits{}.message_bytes_max;
constexpr std::uint32_t places = 4; // of calls; one that timed out here keeps its own until its end is known
constexpr rt::duration timeout_default = 2s;
constexpr rt::duration hint_time = 500ms;
constexpr rt::duration connect_time_min = 1s; // connecting takes what it takes, however little --timeout is

struct call_options {
  remote_place at;
  std::string service;
  std::string request = "{}";
  std::optional<rt::duration> timeout;
  std::int64_t repeat = 0; // 0: one call, whose answer is printed
  std::string field;
  bool pretty = false;
  bool csv = false;
  bool json = false;
  bool plain = false;
  std::size_t profile = 0;
  bool quiet = false;
};

command table_of(call_options& o) {
  return {
      .verb = "call",
      .examples = {{{"rowe call ws://127.0.0.1:8080 /robot/set_speed '{\"speed\":0.5}'", "one answer"},
                    {"rowe call 127.0.0.1:8080 /robot/set_speed '{\"speed\":0.5}' --repeat 1000",
                     "how long it takes"}}},
      .description =
          "Calls a service with a JSON object and prints the object it answers: indented on a terminal, as\n"
          "it came elsewhere. If the service refuses, or nobody provides it, the reason is on stderr\n"
          "(1). With --json there is always one object on stdout, with the members service, answer, error,\n"
          "text and round_trip_ns; with --repeat one about all calls and how long they took.\n",
      .operands =
          {url_operand(o.at.url),
           {.name = "SERVICE", .meaning = "its name, such as /robot/set_speed", .into = &o.service},
           {.name = "JSON", .meaning = "the request (default {})", .into = &o.request, .optional = true}},
      .options = with_remote(
          o.at,
          {
              {"--timeout", "", "TIME",
               "how long to wait for each answer (default 2s), and 1s at least to connect",
               time_span{&o.timeout}},
              {"--repeat", "", "N", "call this many times, one after another",
               integer{&o.repeat, 1, INT64_MAX}},
              {"--pretty", "", "", "for people: indented, also where no terminal is", &o.pretty},
              {"--csv", "", "", "a header and a row", &o.csv},
              {"--field", "", "PATH", "only this part of the answer, such as pose.x or ranges[0]", &o.field},
              {"--json", "", "", "one JSON object, with the answer or the error and with the time", &o.json},
              {"--plain", "", "", "as a plain message with the member `service`, not over rosbridge",
               &o.plain},
              profile_option(o.profile),
              {"--quiet", "-q", "", "print errors only on stderr", &o.quiet},
          })};
}

// What is wrong with the arguments together; empty when nothing is.
std::string contradiction(const call_options& o) {
  if (const auto fault = object_fault(o.request); !fault.empty())
    return joined(quoted(o.request), " ", fault);
  if (o.request.size() > text_bytes_max) {
    return joined("the request has ", o.request.size(), " bytes, at most ", text_bytes_max, " can be sent");
  }
  if (o.plain && read_json(o.request).find("service")) {
    return "with --plain, `service` is the member that names the service; the arguments have one as well";
  }
  if (static_cast<int>(o.json) + static_cast<int>(o.pretty) + static_cast<int>(o.csv) > 1)
    return "--json, --pretty and --csv exclude each other";
  if (o.json && !o.field.empty())
    return "--json has the whole answer: without it --field prints a part of it";
  if (o.repeat > 0 && (o.pretty || o.csv || !o.field.empty()))
    return "--repeat prints no answers: it goes without --field, --pretty and --csv";
  return {};
}

// How one call ended.
struct outcome {
  std::optional<errc> failure;
  std::string text; // the answer, or why there is none
  rt::duration took{};
};

std::string reason_of(const error& why, std::string_view said, rt::duration timeout) {
  switch (why.code) {
  case errc::refused: return printable(said);
  case errc::no_service: return joined("nobody provides it (", printable(said), ")");
  case errc::no_peer: return "there is nobody to ask";
  case errc::timed_out: return joined("no answer within ", seconds_text(timeout));
  case errc::peer_lost: return "the provider went away before it answered";
  default: return why.message();
  }
}

// Why there is no answer; `why` is rowe's word for it, `said` the provider's or the server's.
outcome failed(const error& why, std::string_view said, rt::duration timeout, rt::duration took) {
  return {why.code, reason_of(why, said, timeout), took};
}

// A service, asked over rosbridge.
class over_rosbridge {
 public:
  static result<over_rosbridge> open(endpoint& hub, const call_options& o) {
    auto opened =
        hub.client<json_text, json_text>(o.service, {.depth = places, .text_bytes_max = text_bytes_max});
    if (!opened) return opened.error();
    return over_rosbridge{std::move(*opened), o.request};
  }
  result<message_view> ask(rt::duration timeout) noexcept { return from_.call(request_, timeout); }
  static std::string answer_of(const message_view& reply) { return std::string{reply.value()}; }
  std::string_view refusal() const noexcept { return from_.refusal(); }

 private:
  over_rosbridge(caller<json_text, json_text> from, std::string request)
      : from_{std::move(from)}, request_{std::move(request)} {}

  caller<json_text, json_text> from_;
  std::string request_;
};

// The same, asked with a plain message.
class by_invocation {
 public:
  static result<by_invocation> open(endpoint& hub, const call_options& o) {
    auto opened = hub.open_lane({.depth = places,
                                 .inbox_depth = 1,
                                 .calls = places,
                                 .text_bytes_max = text_bytes_max,
                                 .receive = false});
    if (!opened) return opened.error();
    return by_invocation{std::move(*opened), with_member(o.request, "service", json_string_of(o.service))};
  }
  result<message_view> ask(rt::duration timeout) noexcept { return from_.invoke(request_, timeout); }
  static std::string answer_of(const message_view& reply) {
    return without_member(reply.json(), "in_reply_to");
  }
  std::string_view refusal() const noexcept { return from_.refusal(); }

 private:
  by_invocation(lane from, std::string request) : from_{std::move(from)}, request_{std::move(request)} {}

  lane from_;
  std::string request_;
};

template <class Service>
class asker {
 public:
  asker(Service service, endpoint& hub, remote& connection, rt::duration timeout)
      : service_{std::move(service)}, hub_{hub}, waits_{connection}, timeout_{timeout} {}

  outcome ask() {
    rt::duration took{};
    const auto answer = waits_.during([&] {
      const auto begin = rt::monotonic_clock::now();
      auto reply = service_.ask(timeout_);
      took = rt::monotonic_clock::now() - begin;
      return reply;
    });
    if (answer) return {{}, Service::answer_of(*answer), took};
    return failed(answer.error(), service_.refusal(), timeout_, took);
  }
  // Which service may have been meant, as far as the robot says what it has; to be read behind a sentence.
  std::string hint(std::string_view service) {
    service_asker robot{hub_, waits_, hint_time};
    const auto all = names_of(robot, name_kind::service);
    return all ? did_you_mean(nearest_name(service, *all)) : std::string{};
  }

 private:
  Service service_;
  endpoint& hub_;
  watcher waits_;
  rt::duration timeout_;
};

exit_code exit_code_of(errc failure) noexcept {
  switch (failure) {
  case errc::timed_out: return exit_code::timed_out;
  case errc::no_peer: return exit_code::no_connection;
  case errc::malformed:
  case errc::not_an_object:
  case errc::reserved_member: return exit_code::usage;
  default: return exit_code::failed;
  }
}

// "412.1 µs".
std::string time_text(rt::duration time) {
  std::array<char, 40> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.1f µs",
                                   std::chrono::duration<double, std::micro>(time).count());
  return {buffer.data(), static_cast<std::size_t>(length)};
}

// What the calls come to.
struct tally {
  std::uint64_t calls = 0;
  std::uint64_t failed = 0;
  std::uint64_t timed_out = 0;
  rt::inline_histogram<7> times; // of those that were answered

  void count(const outcome& end) noexcept {
    ++calls;
    if (!end.failure) {
      times.record(end.took);
    } else {
      ++(*end.failure == errc::timed_out ? timed_out : failed);
    }
  }
  std::string json(const call_options& o) const {
    return joined(R"({"service":)", json_string_of(o.service), R"(,"calls":)", calls, R"(,"answered":)",
                  times.count(), R"(,"failed":)", failed, R"(,"timed_out":)", timed_out, R"(,"min_ns":)",
                  times.min().count(), R"(,"p50_ns":)", times.percentile(50).count(), R"(,"p99_ns":)",
                  times.percentile(99).count(), R"(,"max_ns":)", times.max().count(), "}\n");
  }
  std::string line(const call_options& o) const {
    return joined(printable(o.service), ": ", counted(calls, "call"), ", ", times.count(), " answered, ",
                  failed, " failed, ", timed_out, " timed out; min ", time_text(times.min()), ", p50 ",
                  time_text(times.percentile(50)), ", p99 ", time_text(times.percentile(99)), ", max ",
                  time_text(times.max()), "\n");
  }
  exit_code verdict() const noexcept {
    if (failed > 0) return exit_code::failed;
    if (timed_out > 0) return exit_code::timed_out;
    return calls > 0 ? exit_code::done : exit_code::interrupted;
  }
};

std::string json_of(const call_options& o, const outcome& end) {
  const std::string error = end.failure ? json_string_of(rowe::error{*end.failure}.name()) : "null";
  return on_one_line(joined(R"({"service":)", json_string_of(o.service), R"(,"answer":)",
                            end.failure ? "null" : end.text, R"(,"error":)", error, R"(,"text":)",
                            end.failure ? json_string_of(end.text) : "null", R"(,"round_trip_ns":)",
                            end.took.count(), "}"));
}

// The answer for stdout. Nothing: it has no such field.
std::optional<std::string> text_of(const std::string& answer, const call_options& o) {
  const json_value whole = read_json(answer);
  if (o.csv) return message_format{message_format::kind::csv, o.field, false}.text_of({}, whole);
  const auto part = whole.find(o.field);
  if (!part) return std::nullopt;
  const bool for_people = o.pretty || (o.field.empty() && ::isatty(STDOUT_FILENO) == 1);
  return for_people ? outline_of(*part) : on_one_line(part->text());
}

// False: nobody reads our output any more, or the answer `lacks` the field, which was said.
bool print(const outcome& end, const call_options& o, const console& to, bool& lacks) {
  if (o.json) return emit(json_of(o, end));
  if (end.failure) return true;
  const auto text = text_of(end.text, o);
  lacks = !text;
  if (lacks) to.error("the answer has no ", quoted(o.field), ": ", printable(end.text));
  if (lacks || !emit(*text)) return false;
  if (::isatty(STDERR_FILENO) == 1) to.note("answered in ", time_text(end.took));
  return true;
}

template <class Service>
exit_code ask_all(asker<Service>& asking, remote& hub, rt::duration connect_time, const call_options& o,
                  const console& to) {
  tally all;
  std::optional<exit_code> ended; // before all calls were made
  std::string said;               // the same failure again and again is printed once
  for (std::int64_t left = std::max<std::int64_t>(o.repeat, 1); left > 0 && !ended; --left) {
    if (interrupt::seen()) break;
    const outcome end = asking.ask();
    if (end.failure && interrupt::seen()) break; // given up
    hub.report();
    all.count(end);
    bool lacks = false;
    if (o.repeat == 0 && !print(end, o, to, lacks)) {
      if (lacks) ended = exit_code::failed;
      break;
    }
    if (!end.failure) continue;
    const bool is_unknown = end.failure == errc::no_service && !o.plain;
    if (end.text != said)
      to.error("service ", printable(o.service), ": ", end.text, is_unknown ? asking.hint(o.service) : "");
    said = end.text;
    const exit_code meaning = exit_code_of(*end.failure);
    if (meaning == exit_code::usage || meaning == exit_code::no_connection) ended = meaning;
    if (end.failure == errc::peer_lost && left > 1) ended = hub.wait(connect_time);
  }
  if (o.repeat > 0) emit(o.json ? all.json(o) : all.line(o)); // the exit code tells the worst of it too
  return ended && *ended != exit_code::interrupted ? *ended : all.verdict();
}

template <class Service>
exit_code ask_from(endpoint hub, const std::string& url, const call_options& o, const console& to) {
  auto service = Service::open(hub, o);
  if (!service) {
    to.error("cannot call ", quoted(o.service), ": ", service.error().message());
    return tools::exit_code_of(service.error());
  }
  const rt::duration timeout = o.timeout.value_or(timeout_default);
  const rt::duration connect_time = std::max(timeout, connect_time_min);
  remote connection{hub, url, to};
  if (const auto end = connection.wait(connect_time)) return *end;
  asker<Service> asking{std::move(*service), hub, connection, timeout};
  return ask_all(asking, connection, connect_time, o, to);
}

} // namespace

exit_code call(argument_list arguments) {
  call_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"call"};
  to.be_quiet(chosen.quiet);
  if (const std::string wrong = contradiction(chosen); !wrong.empty()) return usage_error("call", wrong);
  const auto bounds = limits_for("call", std::size_t{16 * places} * (text_bytes_max + 1024));
  if (!bounds) return exit_code::usage;
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("call", chosen.at, {.limits = *bounds, .profile = profile_of(chosen.profile)},
                              to, otherwise);
  if (!opened) return otherwise;
  return chosen.plain ? ask_from<by_invocation>(std::move(opened->hub), opened->url, chosen, to)
                      : ask_from<over_rosbridge>(std::move(opened->hub), opened->url, chosen, to);
}

} // namespace rowe::tools
