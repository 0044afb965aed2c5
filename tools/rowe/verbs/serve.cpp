// SPDX-License-Identifier: Apache-2.0
// rowe serve: a hub. The endpoint's own service thread does the work; this thread prints what happens until a
// signal ends it.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/rt/thread.hpp>

#include "../../demo_robot/demo.hpp"
#include "../arguments/command_line.hpp"
#include "../arguments/configuration.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/host_addresses.hpp"
#include "../output.hpp"
#include "../recorders.hpp"
#include "../service_log.hpp"
#include "../service_manager.hpp"
#include "../upkeep.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration event_period = 50ms; // how late an event is printed at most
constexpr rt::duration let_go_time = 5s;    // for the loop to acknowledge that it starts stopped
constexpr rt::duration drain_time = 250ms;  // for what is queued when the program is told to end

command table_of(configuration_options& chosen) {
  return {
      .verb = "serve",
      .examples = {{{"rowe serve --demo", "a robot that drives; open the URL that is printed"},
                    {"rowe serve --config rowe.toml", "all of these options from a file"}}},
      .description =
          "A hub: what one peer publishes reaches every peer that subscribed. Browsers, roslib and other\n"
          "rosbridge clients connect to its WebSocket; the page is at /. One line with the URL goes to\n"
          "stdout when it is ready; what happens goes to stderr. Ctrl-C ends it with a summary.\n"
          "\n"
          "Each option is also a key of a file and a variable of the environment (docs/config.md). "
          "The\n"
          "value of the command line comes before that of the environment, and that before the file's.\n"
          "\n"
          "A topic's message may have 1 MiB. --limit long_message_bytes_max=67108864 lets it have 64 MiB,\n"
          "the most. It takes up to long_slots (8 by default) times as much memory, as it needs it.\n",
      .operands = {},
      .options = chosen.table(),
  };
}

exit_code cannot_listen(const error& reason, const endpoint_options& asked, const console& to) {
  if (reason.code == errc::address_in_use) {
    to.error(reason.message(), " (choose another with --port; 0 takes any free one)");
  } else {
    to.error("cannot listen on ", asked.address, ": ", reason.message());
  }
  return exit_code::failed;
}

// What of the real-time settings was asked for and refused, in one line; empty when nothing was.
// The endpoint has an event for its own thread.
std::string refused_settings(const endpoint& hub, const demo* loop, const rt::grant& process_locked) {
  std::array<char, 256> buffer;
  std::string line;
  const auto add = [&](std::string_view who, std::string_view what) {
    line.append(line.empty() ? "not granted as asked: " : "; ").append(who).append(": ").append(what);
  };
  if (loop != nullptr && !loop->grants().complete()) add("robot thread", loop->grants().text(buffer));
  if (!hub.memory_locked()) {
    constexpr std::size_t kib = 1024;
    add("memory", joined(hub.memory_unlocked_bytes() / kib,
                         " KiB of the endpoint's are not locked: raise `ulimit -l`"));
  } else if (process_locked.refused()) {
    add("memory", "the program's is not locked: raise `ulimit -l`");
  }
  return line;
}

std::uint64_t cycles_of(const endpoint& hub) {
  const auto all = hub.counts();
  const auto found = std::ranges::find(all, "cycles", &count::name);
  return found == all.end() ? 0 : found->value;
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
  if (guarded)
    return to.note("the robot stays stopped until a page guards it and resets its stop (--guarded)");
  if (const auto moves = hub.reset_emergency_stop({}, let_go_time); !moves)
    return to.error("the robot stays stopped: its stop cannot be reset: ", moves.error().message());
  to.note("the robot drives unguarded: it stops when asked to, not when nobody guards it (see --guarded)");
}

// Serves until a signal comes.
exit_code serve_on(endpoint hub, const configuration& of, const console& to, service_manager& manager,
                   upkeep looks) {
  const endpoint_options& asked = of.endpoint;
  const auto begin = rt::monotonic_clock::now();
  recorders records; // before the robot moves
  if (!records.begin(hub, of, to)) return exit_code::failed;
  std::optional<demo> loop;
  if (of.serve.demo) {
    auto handles = demo::open(hub, asked.stop.service_timeout);
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
  if (loop) let_go(hub, of.serve.guarded, to);
  if (asked.insecure) {
    to.say(severity::warning,
           joined("warning: --insecure: ", asked.access.identities.empty()
                                               ? "whoever reaches this port may read and publish everything"
                                               : "nothing is encrypted, so tokens can be read on the way"));
  }

  const std::string authority = joined(host_for_here(asked.address), ":", hub.port(), "/");
  const bool secure = !asked.tls.certificate.empty();
  const std::string_view page = secure ? "https://" : "http://";
  const std::string ready =
      joined("rowe serves ", page, authority, secure ? " (wss://" : " (ws://", authority, ")\n");
  emit(ready); // with nobody to read it, it serves all the same
  if (is_any(asked.address)) {
    for (const std::string& host : hosts_reaching(asked.address))
      to.note("also at ", page, host, ":", hub.port(), "/");
  }

  service_log log{to};
  manager.ready(joined("serves ", page, authority));
  while (!interrupt::seen()) {
    const auto now = rt::monotonic_clock::now();
    log.report(hub, now);
    looks.look(hub, now);
    records.look(to);
    if (manager.watches()) manager.cycles_are(cycles_of(hub), now);
    interrupt::sleep_until(now + event_period);
  }
  manager.stopping("asked to end");
  records.end_black_boxes(to);
  const demo_report driven = loop ? loop->stop() : demo_report{};
  (void)hub.close(drain_time); // a peer that does not read in that time gets nothing more
  log.report(hub, rt::monotonic_clock::now());
  log.finish();
  const bool recorded = records.end_all(to);
  summarise(hub, rt::monotonic_clock::now() - begin, to);
  if (loop) summarise(driven, to);
  return recorded ? exit_code::done : exit_code::failed;
}

} // namespace

exit_code serve(argument_list arguments) {
  configuration_options given;
  if (const auto end = read(table_of(given), arguments)) return *end;
  const auto chosen = given.read_all("serve");
  if (!chosen) return exit_code::usage;
  const configuration& of = chosen->values();
  console to{"serve"};
  to.be_quiet(of.serve.quiet);
  to.write_as({.json = of.serve.log == log_format::json, .priorities = journal_reads_stderr()});
  service_manager manager{service_manager::environment::of_process()};
  if (!manager.fault().empty()) to.error(manager.fault());
  auto hub = endpoint::listen(of.endpoint);
  if (!hub) return cannot_listen(hub.error(), of.endpoint, to);
  return serve_on(std::move(hub).value(), of, to, manager, upkeep{given, to});
}

} // namespace rowe::tools
