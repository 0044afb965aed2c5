// SPDX-License-Identifier: Apache-2.0
// rowe serve: a hub. The endpoint's own service thread does the work; this thread prints what happens until a
// signal ends it.
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/rt/thread.hpp>

#include "../../demo_robot/demo.hpp"
#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../arguments/values.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/host_addresses.hpp"
#include "../network/remote.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t port_default = 8080;
constexpr std::int64_t port_max = 65535;
constexpr rt::duration event_period = 50ms; // how late an event is printed at most
constexpr rt::duration let_go_time = 5s;    // for the loop to acknowledge that it starts stopped
constexpr rt::duration drain_time = 250ms;  // for what is queued when the program is told to end
constexpr int demo_service_priority = demo::priority - 10; // below the loop it serves
// In rowe::idle's order.
constexpr std::array<std::string_view, 4> idle_names{"poll", "spin", "wake", "phase"};

struct serve_options {
  std::int64_t port = -1; // as given; -1: not
  std::string listen;     // ADDR:PORT as given, or empty
  bool demo = false;
  bool guarded = false;
  bool insecure = false;
  std::vector<std::string> allow_origins;
  std::vector<std::string> allow_hosts;
  std::vector<std::string> limits;
  std::string name;
  std::size_t idle = 0;
  std::int64_t cpu = -1;
  std::int64_t priority = -1; // as given; -1: not
  std::size_t profile = 0;
  bool quiet = false;
};

command table_of(serve_options& o) {
  const std::int64_t last_cpu = std::max(1L, ::sysconf(_SC_NPROCESSORS_CONF)) - 1;
  return {
      .verb = "serve",
      .examples = {{{"rowe serve --demo", "a robot that drives; open the URL that is printed"},
                    {"rowe serve --listen 0.0.0.0:8080 --insecure", "a hub for the whole network"}}},
      .description =
          "A hub: what one peer publishes reaches every peer that subscribed. Browsers, roslib and other\n"
          "rosbridge clients connect to its WebSocket; the page is at /. One line with the URL goes to\n"
          "stdout when it is ready; what happens goes to stderr. Ctrl-C ends it with a summary.\n",
      .operands = {},
      .options = {
          {"--port", "", "N", "TCP port on 127.0.0.1; 0 takes any free one (default 8080)",
           integer{&o.port, 0, port_max}},
          {"--listen", "", "ADDR:PORT", "listen elsewhere; beyond loopback only with --insecure", &o.listen},
          {"--demo", "", "", "drive a simulated robot at 1 kHz: topic /odom, service /robot/set_speed",
           &o.demo},
          {"--guarded", "", "", "the demo's robot stands until a page guards it and resets its stop",
           &o.guarded},
          {"--insecure", "", "", "whoever reaches the port may read and publish everything", &o.insecure},
          {"--allow-origin", "", "O", "let pages of this origin connect, http://HOST[:PORT]; repeatable",
           &o.allow_origins},
          {"--allow-host", "", "H", "answer to this host name as well; repeatable", &o.allow_hosts},
          {"--limit", "", "NAME=VALUE", "a member of rowe::limits, such as topics_max=256; repeatable",
           &o.limits},
          {"--name", "", "NAME", "what the page shows (default: the host's name)", &o.name},
          {"--idle", "", "poll|spin|wake|phase", "how the service thread waits (default poll)",
           choice{&o.idle, idle_names}},
          {"--cpu", "", "N", "pin the service thread to this core", integer{&o.cpu, 0, last_cpu}},
          {"--priority", "", "N", "SCHED_FIFO priority of the service thread (default none; 70 with --demo)",
           integer{&o.priority, 1, 99}},
          profile_option(o.profile),
          {"--quiet", "-q", "", "print errors and warnings only", &o.quiet},
      }};
}

endpoint_options endpoint_options_of(const serve_options& o) {
  endpoint_options to;
  to.relay = true;
  to.idle_policy = static_cast<idle>(o.idle);
  to.service_cpu = static_cast<int>(o.cpu);
  const int priority_default = o.demo ? demo_service_priority : 0;
  to.service_priority = o.priority < 0 ? priority_default : static_cast<int>(o.priority);
  to.name = o.name;
  to.profile = profile_of(o.profile);
  to.insecure = o.insecure;
  to.allow_origins = o.allow_origins;
  to.allow_hosts = o.allow_hosts;
  if (o.demo) to.stop = demo::stop_of(o.guarded);
  return to;
}

exit_code cannot_listen(const error& reason, const endpoint_options& asked, const console& to) {
  switch (reason.code) {
  case errc::not_loopback:
    to.error("listening on ", asked.address,
             " lets everyone who reaches it read and publish: add --insecure");
    return exit_code::usage;
  case errc::bad_argument: to.error(reason.message()); return exit_code::usage;
  case errc::address_in_use:
    to.error(reason.message(), " (choose another with --port; 0 takes any free one)");
    return exit_code::failed;
  default: to.error("cannot listen on ", asked.address, ": ", reason.message()); return exit_code::failed;
  }
}

// What of the real-time settings was asked for and refused, in one line; empty when nothing was.
// The endpoint has an event for its own thread.
std::string refused_settings(const endpoint& hub, const demo* loop, const rt::grant& process_locked) {
  std::array<char, 256> buffer;
  std::string line;
  const auto add = [&](std::string_view who, std::string_view what) {
    line.append(line.empty() ? "not as real-time as asked: " : "; ").append(who).append(": ").append(what);
  };
  if (loop != nullptr && !loop->grants().complete()) add("robot thread", loop->grants().text(buffer));
  if (!hub.memory_locked()) {
    add("memory", "the endpoint's is not locked: raise `ulimit -l`");
  } else if (process_locked.refused()) {
    add("memory", "the program's is not locked: raise `ulimit -l`");
  }
  return line;
}

// What a program would raise in its options is raised here on the command line.
std::string with_option(std::string sentence) {
  constexpr std::string_view member = "`limits::";
  if (const auto at = sentence.find(member); at != sentence.npos)
    sentence.replace(at, member.size(), "`--limit ");
  return sentence;
}

void report_events(endpoint& hub, const console& to) {
  while (const auto happened = hub.try_event()) {
    const bool grave =
        happened->what_kind == event::kind::warning || happened->what_kind == event::kind::limit;
    if (grave) {
      to.error(with_option(sentence_of(*happened)));
    } else {
      to.note(with_option(sentence_of(*happened)));
    }
  }
}

std::string in_microseconds(rt::duration time) { return joined(time.count() / 1000, " µs"); }

// The counters, a line for each group in the order of their first. Zeros are left out; that nothing was lost
// is news.
void summarise(const endpoint& hub, rt::duration up, const console& to) {
  to.note("up for ", seconds_text(up));
  std::vector<std::pair<std::string_view, std::string>> lines;
  for (const count& one : hub.counts()) {
    auto line = std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.first == one.group; });
    if (line == lines.end()) line = lines.insert(line, {one.group, joined(one.group, ":")});
    if (one.value != 0)
      line->second.append(joined(line->second.ends_with(':') ? " " : ", ", one.name, " ", one.value));
  }
  for (const auto& [group, line] : lines) {
    if (!line.ends_with(':')) {
      to.note(line);
    } else if (group == "loss") {
      to.note(line, " none");
    }
  }
}

void summarise(const demo_report& driven, const console& to) {
  to.note("robot: ", counted(driven.cycles, "cycle"), ", ", driven.skipped, " skipped; late by ",
          in_microseconds(driven.late_p50), " (p50), ", in_microseconds(driven.late_p99), " (p99), ",
          in_microseconds(driven.late_max), " (max); published ", driven.published, ", refused ",
          driven.refused);
}

// A robot starts stopped. Whoever starts the demo wants to see it drive, so it is let go once, and no more.
void let_go(endpoint& hub, bool guarded, const console& to) {
  if (guarded) return to.note("the robot stands until a page guards it and resets its stop (--guarded)");
  if (const auto moves = hub.reset_emergency_stop({}, let_go_time); !moves)
    return to.error("the robot stands: its stop cannot be reset: ", moves.error().message());
  to.note("the robot drives unguarded: it stops when asked to, not when nobody watches (see --guarded)");
}

// Serves until a signal comes.
exit_code serve_on(endpoint hub, const endpoint_options& asked, const serve_options& o, const console& to) {
  const auto begin = rt::monotonic_clock::now();
  std::optional<demo> loop;
  if (o.demo) {
    auto handles = demo::open(hub);
    if (!handles) {
      to.error("the robot cannot be reached: ", handles.error().message());
      return exit_code::failed;
    }
    loop.emplace(std::move(handles).value(), asked.service_cpu);
    if (loop->error() != 0) {
      to.error("the robot's thread cannot be started (errno ", loop->error(), ")");
      return exit_code::failed;
    }
  }
  // Last, so that all there is gets locked and no limit on it can hinder the set-up.
  const rt::grant locked = loop ? rt::lock_process_memory() : rt::grant{};
  if (const std::string refused = refused_settings(hub, loop ? &*loop : nullptr, locked); !refused.empty()) {
    to.error(refused);
  }
  if (loop) let_go(hub, o.guarded, to);
  if (o.insecure) to.error("warning: --insecure: whoever reaches this port may read and publish everything");

  const std::string authority = joined(host_for_here(asked.address), ":", hub.port(), "/");
  const std::string ready = joined("rowe serves http://", authority, " (ws://", authority, ")\n");
  (void)emit(ready); // with nobody to read it, it serves all the same
  if (is_any(asked.address)) {
    for (const std::string& host : hosts_reaching(asked.address))
      to.note("also at http://", host, ":", hub.port(), "/");
  }

  while (!interrupt::seen()) {
    report_events(hub, to);
    interrupt::sleep_until(rt::monotonic_clock::now() + event_period);
  }
  const demo_report driven = loop ? loop->stop() : demo_report{};
  (void)hub.close(drain_time); // a peer that does not read in that time gets nothing more
  report_events(hub, to);
  summarise(hub, rt::monotonic_clock::now() - begin, to);
  if (loop) summarise(driven, to);
  return exit_code::done;
}

} // namespace

exit_code serve(argument_list arguments) {
  serve_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"serve"};
  to.be_quiet(chosen.quiet);

  const auto bounds = limits_for("serve", 0, chosen.limits);
  if (!bounds) return exit_code::usage;
  endpoint_options options = endpoint_options_of(chosen);
  options.limits = *bounds;
  if (chosen.guarded && !chosen.demo) return usage_error("serve", "--guarded is for --demo");
  auto port = static_cast<std::uint16_t>(chosen.port < 0 ? port_default : chosen.port);
  if (!chosen.listen.empty()) {
    if (chosen.port >= 0) return usage_error("serve", "--port and --listen exclude each other");
    if (const std::string wrong = split_listen(chosen.listen, options.address, port); !wrong.empty()) {
      return usage_error("serve", wrong);
    }
  }
  auto hub = endpoint::listen(port, options);
  if (!hub) return cannot_listen(hub.error(), options, to);
  return serve_on(std::move(hub).value(), options, chosen, to);
}

} // namespace rowe::tools
