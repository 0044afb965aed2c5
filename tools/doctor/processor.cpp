// SPDX-License-Identifier: Apache-2.0
// The cores themselves: how fast they run, how deep they sleep, with whom they share, how hot they are.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <optional>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

// Adds "cpu 3: what", or ", 3: what".
void append(std::string& to, int cpu, std::string_view what) {
  to.append(joined(to.empty() ? "cpu " : ", ", cpu, ": ", what));
}

finding governor(const machine& on) {
  finding result;
  bool any = false;
  std::string found;
  for (const int cpu : on.cpus) {
    const reading file = on.files.read(cpu_path(cpu, "cpufreq/scaling_governor"));
    if (!file) continue;
    any = true;
    append(found, cpu, file.text);
    if (file.text == "performance") continue;
    result.mark = level::warn;
    result.commands.push_back(joined("echo performance > ", cpu_path(cpu, "cpufreq/scaling_governor")));
  }
  if (any) {
    result.found = found;
    return result;
  }
  if (!on.files.exists("/sys/devices/system/cpu")) return unseen("/sys/devices/system/cpu", ENOENT);
  return {.mark = level::info, .found = "no cpufreq: firmware or a hypervisor decides"};
}

// The slowest state of idleness that this core may enter.
struct depth {
  std::string name;
  std::int64_t exit_us = 0;
};
std::optional<depth> deepest(const machine& on, int cpu) {
  std::optional<depth> result;
  for (const std::string& state : on.files.names_in(cpu_path(cpu, "cpuidle"))) {
    const std::string folder = cpu_path(cpu, joined("cpuidle/", state));
    const auto exit_us = on.files.number(joined(folder, "/latency"));
    if (!exit_us || on.files.number(joined(folder, "/disable")).value_or(0) != 0) continue;
    if (result && result->exit_us >= *exit_us) continue;
    result = depth{.name = on.files.read(joined(folder, "/name")).text, .exit_us = *exit_us};
  }
  return result;
}

finding idle_states(const machine& on) {
  constexpr std::int64_t exit_us_max = 20; // a fifth of what a wake-up may take
  const reading driver = on.files.read("/sys/devices/system/cpu/cpuidle/current_driver");
  if (!driver) return unseen("/sys/devices/system/cpu/cpuidle/current_driver", driver.error);
  finding result;
  std::int64_t worst = 0;
  std::string states;
  for (const int cpu : on.cpus) {
    const auto deep = deepest(on, cpu);
    if (!deep) continue;
    append(states, cpu, joined(deep->name, " (", deep->exit_us, " µs)"));
    worst = std::max(worst, deep->exit_us);
  }
  result.values = {{"exit_us", worst}};
  result.found = joined(driver.text, states.empty() ? "" : "; deepest: ", states);
  if (worst > exit_us_max) {
    result.mark = level::warn;
    result.commands = {
        "exec 3> /dev/cpu_dma_latency; printf '\\0\\0\\0\\0' >&3    # until this shell ends; or",
        joined("cpupower -c ", on.cpus.text(), " idle-set -D ", exit_us_max)};
  } else if (driver.text == "haltpoll" || states.empty()) {
    result.mark = level::info; // how deep the core really sleeps is known to others
  }
  return result;
}

finding siblings(const machine& on) {
  const reading active = on.files.read("/sys/devices/system/cpu/smt/active");
  if (!active) return unseen("/sys/devices/system/cpu/smt/active", active.error);
  if (active.text != "1") return {.found = "none"};
  finding result;
  for (const int cpu : on.cpus) {
    const std::string path = cpu_path(cpu, "topology/thread_siblings_list");
    const reading file = on.files.read(path);
    const auto together = cpu_list::of_list(file.text);
    if (!file || !together) return unseen(path, file.error);
    const cpu_list others = together->without(cpu_list{{cpu}});
    if (others.empty()) continue;
    result.mark = level::warn;
    append(result.found, cpu, joined("with ", others.text()));
    for (const int other : others) {
      if (!on.cpus.contains(other)) result.commands.push_back(joined("echo 0 > ", cpu_path(other, "online")));
    }
  }
  if (result.found.empty()) result.found = "none (those of the loop's cores are off)";
  return result;
}

finding capacity(const machine& on) {
  std::int64_t most = 0;
  for (const std::string& name : on.files.names_in("/sys/devices/system/cpu")) {
    const auto here = on.files.number(joined("/sys/devices/system/cpu/", name, "/cpu_capacity"));
    most = std::max(most, here.value_or(0));
  }
  if (most == 0) {
    if (!on.files.exists("/sys/devices/system/cpu")) return unseen("/sys/devices/system/cpu", ENOENT);
    return {.mark = level::info, .found = "not reported (no cpu_capacity)"};
  }
  finding result;
  for (const int cpu : on.cpus) {
    const auto here = on.files.number(cpu_path(cpu, "cpu_capacity"));
    if (!here || *here == most) continue;
    result.mark = level::warn;
    append(result.found, cpu, joined(*here, " of ", most));
  }
  if (result.found.empty()) result.found = joined("full (", most, ")");
  return result;
}

// The lowest temperature at which the kernel or the firmware slows the cores of a zone down.
std::int64_t throttles_at(const machine& on, const std::string& zone) {
  std::int64_t lowest = 80'000; // where it does not say: the mark of common boards
  bool told = false;
  for (const std::string& name : on.files.names_in(zone)) {
    if (!name.starts_with("trip_point_") || !name.ends_with("_temp")) continue;
    const std::string kind = joined(name.substr(0, name.size() - 4), "type");
    const std::string type = on.files.read(joined(zone, "/", kind)).text;
    const auto at = on.files.number(joined(zone, "/", name));
    if (!at || *at <= 0 || (type != "passive" && type != "hot")) continue;
    lowest = told ? std::min(lowest, *at) : *at;
    told = true;
  }
  return lowest;
}

finding temperature(const machine& on) {
  constexpr std::string_view folder = "/sys/class/thermal";
  constexpr std::int64_t near = 5'000; // thousandths of a degree
  finding result;
  std::optional<std::int64_t> hottest;
  std::int64_t throttled = 0;
  for (const std::string& name : on.files.names_in(folder)) {
    const std::string zone = joined(folder, "/", name);
    const auto now = on.files.number(joined(zone, "/temp"));
    if (!name.starts_with("thermal_zone") || !now) continue;
    hottest = std::max(hottest.value_or(*now), *now);
    if (*now + near >= throttles_at(on, zone)) result.mark = level::warn;
  }
  for (const int cpu : on.cpus) {
    const auto count = on.files.number(cpu_path(cpu, "thermal_throttle/core_throttle_count"));
    throttled = std::max(throttled, count.value_or(0));
  }
  if (!hottest && throttled == 0) {
    if (!on.files.exists(folder)) return unseen(folder, ENOENT);
    return {.mark = level::info, .found = "no sensor"};
  }
  if (hottest) {
    result.values = {{"hottest_millidegrees", *hottest}};
    result.found = joined("hottest zone ", *hottest / 1000, " C");
  }
  if (throttled != 0) {
    result.mark = level::warn;
    result.found.append(joined(hottest ? "; " : "", "slowed down ", throttled, " times since start"));
  }
  return result;
}

// clang-format off
constexpr std::array<check, 5> processor_table{{
    {.name = "governor", .title = "frequency governor", .wanted = "performance",
     .why = "a core that slept at a low frequency runs the first microseconds of a cycle at it",
     .change = "choose the governor performance", .examine = governor},
    {.name = "idle_states", .title = "idle states", .wanted = "out of the deepest within 20 µs",
     .why = "a core that sleeps deeply wakes up late",
     .change = "hold /dev/cpu_dma_latency at 0 while the loop runs, or disable the deep states",
     .examine = idle_states},
    {.name = "siblings", .title = "SMT siblings", .wanted = "none beside the loop's cores",
     .why = "two hardware threads share one core's units and caches",
     .change = "switch the siblings off, or leave them idle", .examine = siblings},
    {.name = "capacity", .title = "core capacity", .wanted = "full",
     .why = "this machine has larger cores", .change = "choose a larger core with --cpu, and for the loop",
     .examine = capacity},
    {.name = "temperature", .title = "temperature", .wanted = "5 C below where cores slow down, or less",
     .why = "hot cores are slowed down, whatever the governor says",
     .change = "cool the machine, or give it a sufficient power supply", .examine = temperature},
}};
// clang-format on

} // namespace

std::span<const check> processor_checks() { return processor_table; }

} // namespace rowe::tools::fitness
