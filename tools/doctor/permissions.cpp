// SPDX-License-Identifier: Apache-2.0
// What this process is allowed to: priorities, locked memory, and for how long a priority lasts.
#include <array>
#include <charconv>
#include <optional>

#include <rowe/limits.hpp>

#include "../rowe/arguments/values.hpp"
#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

// The soft limit of /proc/self/limits, as it is spelt: a number or "unlimited"; empty: not visible.
std::string_view limit_of(std::string_view limits, std::string_view name) {
  for (const std::string_view line : lines_of(limits)) {
    if (!line.starts_with(name)) continue;
    const auto words = words_of(line.substr(name.size()));
    return words.empty() ? std::string_view{} : words.front();
  }
  return {};
}

constexpr unsigned cap_ipc_lock = 14; // their bits in CapEff of /proc/self/status
constexpr unsigned cap_sys_nice = 23;

// Nothing: it does not show. Those of a user namespace do not count: they end where the machine begins.
std::optional<bool> has_capability(const machine& on, unsigned bit) {
  const reading status = on.files.read("/proc/self/status");
  const reading map = on.files.read("/proc/self/uid_map");
  const std::string_view word = entry_of(status.text, "CapEff");
  std::uint64_t capabilities = 0;
  const auto end = std::from_chars(word.data(), word.data() + word.size(), capabilities, 16);
  const auto mapped = words_of(map.text);
  if (end.ec != std::errc{} || mapped.size() < 3) return std::nullopt;
  const bool machines_own = mapped[0] == "0" && mapped[1] == "0" && mapped[2] == "4294967295";
  return machines_own && (capabilities >> bit & 1U) != 0;
}

// The time that group scheduling (CONFIG_RT_GROUP_SCHED) leaves to the real-time threads of our control
// group, in each second; nothing where there is no such thing, or where it does not show.
std::optional<std::int64_t> group_budget(const machine& on) {
  const reading groups = on.files.read("/proc/self/cgroup");
  for (const std::string_view line : lines_of(groups.text)) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string_view::npos ? first : line.find(':', first + 1);
    if (second == std::string_view::npos) continue;
    const std::string_view controllers = line.substr(first + 1, second - first - 1);
    if (controllers != "cpu" && !controllers.starts_with("cpu,")) continue;
    const std::string_view path = line.substr(second + 1);
    for (const std::string_view mount : {"/sys/fs/cgroup/cpu", "/sys/fs/cgroup/cpu,cpuacct"}) {
      const auto budget = on.files.number(joined(mount, path == "/" ? "" : path, "/cpu.rt_runtime_us"));
      if (budget) return budget;
    }
  }
  return std::nullopt;
}

finding sched_fifo(const machine& on) {
  const auto tried = on.trial.fifo();
  if (!tried) return untried();
  const reading limits = on.files.read("/proc/self/limits");
  const std::string_view limit = limit_of(limits.text, "Max realtime priority");
  const auto capable = has_capability(on, cap_sys_nice);
  const auto budget = group_budget(on);
  finding result{.mark = *tried ? level::ok : level::fail, .found = *tried ? "granted" : "refused"};
  result.found.append(joined(" (rtprio limit ", limit.empty() ? "not visible" : limit,
                             !capable   ? ""
                             : *capable ? ", CAP_SYS_NICE"
                                        : ", no CAP_SYS_NICE"));
  if (budget) result.found.append(joined(", group budget ", *budget, " µs a second"));
  result.found.append(")");
  if (!*tried && capable == true) {
    // Permitted, and refused all the same: the control group has no budget.
    result.commands = {
        "echo 400000 > /sys/fs/cgroup/cpu/YOUR/GROUP/cpu.rt_runtime_us    # cgroup v1",
        "echo PROCESS > /sys/fs/cgroup/cgroup.procs    # cgroup v2: only the root group has one"};
  } else {
    result.commands = {"echo 'YOU - rtprio 90' >> /etc/security/limits.d/rowe.conf    # then log in again",
                       "LimitRTPRIO=90    # in a unit of systemd"};
  }
  return result;
}

std::string mebibytes_text(std::int64_t bytes) {
  const std::int64_t tenths = (bytes * 10 + (1 << 19)) / (1 << 20);
  return joined(tenths / 10, ".", tenths % 10, " MiB");
}

finding memory_lock(const machine& on) {
  const auto footprint = static_cast<std::int64_t>(limits{}.footprint_bytes());
  const auto tried = on.trial.lock(static_cast<std::size_t>(footprint));
  if (!tried) return untried();
  const auto everything = on.trial.lock_everything();
  const reading file = on.files.read("/proc/self/limits");
  const std::string_view limit = limit_of(file.text, "Max locked memory");
  const auto limit_bytes = integer_of(limit);
  finding result;
  result.values = {{"endpoint_bytes", footprint}, {"limit_bytes", limit_bytes.value_or(-1)}};
  result.found =
      joined(*tried ? "the " : "not the ", mebibytes_text(footprint), " of an endpoint (limit ",
             limit_bytes ? mebibytes_text(*limit_bytes) : std::string{limit.empty() ? "not visible" : limit},
             has_capability(on, cap_ipc_lock) == true ? ", CAP_IPC_LOCK)" : ")");
  if (!*tried) {
    result.mark = level::fail;
  } else if (everything && !*everything) {
    result.mark = level::warn;
    result.found.append(", but not a whole program");
  }
  result.commands = {
      "echo 'YOU - memlock unlimited' >> /etc/security/limits.d/rowe.conf    # then log in again",
      "LimitMEMLOCK=infinity    # in a unit of systemd"};
  return result;
}

// Linux 6.12 gave the throttle's work to the fair server, unless threads are scheduled by groups.
bool throttle_is_gone(const machine& on) { return linux_at_least(on.files, 6, 12) && !group_budget(on); }

finding rt_throttling(const machine& on) {
  finding result = setting(on, "/proc/sys/kernel/sched_rt_runtime_us", -1, level::warn);
  const auto period = on.files.number("/proc/sys/kernel/sched_rt_period_us");
  if (!result.visible || result.mark == level::ok) return result;
  result.found.append(joined(" µs of ", period ? std::to_string(*period) : "each period of", " µs"));
  if (throttle_is_gone(on)) {
    result.mark = level::info;
    result.found.append("; since Linux 6.12 the fair server does this unless groups are scheduled");
  }
  return result;
}

finding fair_server(const machine& on) {
  constexpr std::string_view folder = "/sys/kernel/debug/sched/fair_server";
  if (on.files.exists(folder)) {
    finding result;
    for (const int cpu : on.cpus) {
      const std::string path = joined(folder, "/cpu", cpu, "/runtime");
      const auto runtime = on.files.number(path);
      if (!runtime) return unseen(path, on.files.read(path).error);
      if (*runtime == 0) continue;
      result.mark = level::warn;
      result.found.append(joined(result.found.empty() ? "" : ", ", "cpu ", cpu, ": ",
                                 time_text(rt::duration{*runtime}), " a second"));
      result.commands.push_back(joined("echo 0 > ", path));
    }
    if (result.found.empty()) result.found = "off";
    return result;
  }
  const reading version = on.files.read("/proc/version");
  if (!version) return unseen("/proc/version", version.error);
  if (!linux_at_least(on.files, 6, 12)) return {.found = "none (it came with Linux 6.12)"};
  finding result = unseen(folder, on.files.read(folder).error);
  result.found.append("; 50 ms a second unless somebody changed it");
  result.commands = {"mount -t debugfs none /sys/kernel/debug    # then once more, as root"};
  return result;
}

// clang-format off
constexpr std::array<check, 4> permission_table{{
    {.name = "sched_fifo", .title = "may use SCHED_FIFO", .wanted = "granted",
     .why = "an ordinary thread waits for its turn behind every other",
     .change = "raise the rtprio limit, or grant CAP_SYS_NICE; in a control group, give it a budget",
     .vital = true, .examine = sched_fifo},
    {.name = "memory_lock", .title = "may lock memory", .wanted = "an endpoint, and the whole program",
     .why = "memory that is not locked can be taken away, and touching it then waits for the disk",
     .change = "raise the memlock limit, or grant CAP_IPC_LOCK", .vital = true, .examine = memory_lock},
    {.name = "rt_throttling", .title = "throttling", .wanted = "-1, or threads that sleep 5 % of the time",
     .why = "a SCHED_FIFO thread that never sleeps is taken off its core for the rest of each period",
     .change = "let threads that spin sleep now and then (rowe's do), or switch it off", .examine = rt_throttling},
    {.name = "fair_server", .title = "fair server", .wanted = "off on the loop's core, or threads that sleep",
     .why = "where ordinary threads starve, it runs them before any SCHED_FIFO thread",
     .change = "let threads that spin sleep now and then (rowe's do), or switch it off", .examine = fair_server},
}};
// clang-format on

} // namespace

std::span<const check> permission_checks() { return permission_table; }

} // namespace rowe::tools::fitness
