// SPDX-License-Identifier: Apache-2.0
// What interrupts a loop now and then; and, as the proof of all the rest, how late a thread really wakes up.
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>

#include <rowe/options.hpp>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

using namespace std::chrono_literals;

finding timer_slack(const machine& on) {
  constexpr std::string_view path = "/proc/self/timerslack_ns";
  const auto slack = on.files.number(path);
  if (!slack) return unseen(path, on.files.read(path).error);
  return {.mark = *slack > 1'000 ? level::info : level::ok,
          .found = time_text(rt::duration{*slack}),
          .values = {{"slack_ns", *slack}}};
}

finding timer_migration(const machine& on) {
  return setting(on, "/proc/sys/kernel/timer_migration", 0, level::info);
}

finding statistics(const machine& on) {
  finding result = setting(on, "/proc/sys/vm/stat_interval", 120, level::info);
  if (!result.visible) return result;
  if (result.values[0].number > 60) result.mark = level::ok;
  result.found.append(" s");
  return result;
}

finding watchdog(const machine& on) { return setting(on, "/proc/sys/kernel/nmi_watchdog", 0, level::warn); }

finding pressure(const machine& on) {
  constexpr std::string_view path = "/proc/pressure/cpu";
  const reading file = on.files.read(path);
  if (!file) return unseen(path, file.error);
  for (const std::string_view line : lines_of(file.text)) {
    if (!line.starts_with("some avg10=")) continue;
    const std::string_view share = words_of(line)[1].substr(std::string_view{"avg10="}.size());
    double percent = 0;
    const auto end = std::from_chars(share.data(), share.data() + share.size(), percent);
    if (end.ec != std::errc{}) break;
    return {.mark = percent > 10 ? level::warn : level::ok,
            .found = joined(share, " % of the last 10 s"),
            .values = {{"some_avg10_percent", static_cast<std::int64_t>(percent)}}};
  }
  return {.found = joined("not visible here (", path, " has no average)"), .visible = false};
}

finding neighbours(const machine& on) {
  const auto running = processes(on.files, "kdamond");
  if (!running) return processes_unseen();
  std::string found;
  for (const std::string& number : *running) {
    const reading status = on.files.read(joined("/proc/", number, "/status"));
    const auto cpus = cpu_list::of_list(entry_of(status.text, "Cpus_allowed_list"));
    if (cpus && cpus->both(on.cpus).empty()) continue;
    found.append(joined(found.empty() ? "" : ", ", entry_of(status.text, "Name"), " (process ", number, ")"));
  }
  if (found.empty()) return {.found = "none"};
  return {
      .mark = level::warn, .found = found, .commands = {"cat /sys/kernel/mm/damon/admin/kdamonds/*/state"}};
}

constexpr rt::duration late_warn = 100us;
constexpr rt::duration late_fail = 1ms;

std::string sentence_of(const wake_ups& one) {
  if (one.refused != 0) return joined("cpu ", one.cpu, ": not allowed to this process");
  if (one.count == 0) return joined("cpu ", one.cpu, ": interrupted before the first");
  return joined("cpu ", one.cpu, ": min ", time_text(one.min), ", p50 ", time_text(one.p50), ", p99 ",
                time_text(one.p99), ", max ", time_text(one.max), " of ", one.count,
                one.fifo ? "" : ", as an ordinary thread", one.cut_short ? ", cut short" : "");
}

// An ordinary thread's lateness proves nothing of a SCHED_FIFO one's: that is the check sched_fifo.
level level_of(const wake_ups& one) {
  if (one.max >= late_fail && one.fifo) return level::fail;
  return one.max >= late_warn || !one.fifo ? level::warn : level::ok;
}

// The times of the stop that fit such threads: what rowe takes by itself, or many times the latest wake-up,
// because a short test misses rare delays.
struct stop_times {
  std::int64_t loop_ms;
  std::int64_t service_ms;
};
stop_times proposed_for(rt::duration latest, bool fifo) noexcept {
  constexpr rt::duration step = 10ms;
  constexpr rt::duration most = 10s;
  constexpr int reserve = 20;
  const auto at_least = [&](rt::duration usual, int times) {
    const rt::duration wanted = std::min(latest, most) * times;
    const rt::duration rounded = (wanted + step - 1ns) / step * step;
    return std::chrono::duration_cast<std::chrono::milliseconds>(std::clamp(rounded, usual, most)).count();
  };
  return {at_least(loop_timeout_default(fifo), reserve),
          at_least(service_timeout_default(fifo), reserve / 2)};
}

finding self_test(const machine& on) {
  if (on.self_test == rt::duration{0}) return {.mark = level::info, .found = "left out"};
  const auto results = on.trial.sleep_and_wake(on.cpus, on.self_test);
  finding result;
  const wake_ups* worst = nullptr;
  bool all_fifo = true;
  for (const wake_ups& one : results) {
    result.found.append(joined(result.found.empty() ? "" : "; ", sentence_of(one)));
    if (one.count == 0) continue;
    if (worst == nullptr || one.max > worst->max) worst = &one;
    all_fifo = all_fifo && one.fifo;
    result.mark = std::max(result.mark, level_of(one));
    if (!one.bars.empty()) result.details.append(joined("cpu ", one.cpu, "\n", one.bars));
  }
  if (worst == nullptr) {
    finding nothing = untried();
    if (!results.empty()) nothing.found = joined("not visible here (", result.found, ")");
    return nothing;
  }
  const stop_times proposed = proposed_for(worst->max, all_fifo);
  result.found.append(joined("; for the stop: loop_timeout ", proposed.loop_ms, " ms, service_timeout ",
                             proposed.service_ms, " ms"));
  result.values = {{"cpu", worst->cpu},
                   {"fifo", worst->fifo ? 1 : 0},
                   {"count", static_cast<std::int64_t>(worst->count)},
                   {"min_ns", worst->min.count()},
                   {"p50_ns", worst->p50.count()},
                   {"p99_ns", worst->p99.count()},
                   {"max_ns", worst->max.count()},
                   {"loop_timeout_ms", proposed.loop_ms},
                   {"service_timeout_ms", proposed.service_ms}};
  return result;
}

// clang-format off
constexpr std::array<check, 7> noise_table{{
    {.name = "timer_slack", .title = "timer slack", .wanted = "1 µs or less",
     .why = "an ordinary thread may wake up this much late, to save power; SCHED_FIFO threads never do",
     .change = "nothing for rowe's threads, which set it themselves; elsewhere prctl(PR_SET_TIMERSLACK, 1)",
     .examine = timer_slack},
    {.name = "timer_migration", .title = "timer migration", .wanted = "0",
     .why = "timers of idle cores are moved to busy ones, the loop's perhaps", .change = "switch it off",
     .examine = timer_migration},
    {.name = "statistics", .title = "memory statistics", .wanted = "every 120 s",
     .why = "so often each core is interrupted to add up its counters", .change = "make it rare",
     .examine = statistics},
    {.name = "nmi_watchdog", .title = "lock-up watchdog", .wanted = "0",
     .why = "it interrupts each core every few seconds, and nothing can mask it", .change = "switch it off",
     .examine = watchdog},
    {.name = "pressure", .title = "waiting for a core", .wanted = "10 % of the time or less",
     .why = "threads of this machine wait for their turn: it is busy now",
     .change = "find out who is at work, and measure again", .examine = pressure},
    {.name = "neighbours", .title = "memory watchers", .wanted = "none on the loop's cores",
     .why = "DAMON looks at page tables many times a second", .change = "stop it, or move it to another core",
     .examine = neighbours},
    {.name = "self_test", .title = "wake-ups", .wanted = "max below 100 µs; from 1 ms on it fails", .why =
     "a thread that slept until a time woke up this much after it; short tests miss rare delays",
     .change = "see above; then for an hour: --duration 1h", .vital = true, .examine = self_test},
}};
// clang-format on

} // namespace

std::span<const check> noise_checks() { return noise_table; }

} // namespace rowe::tools::fitness
