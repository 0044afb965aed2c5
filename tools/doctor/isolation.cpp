// SPDX-License-Identifier: Apache-2.0
// Who else runs on the loop's cores: other threads, the kernel's tick and callbacks, interrupts.
#include <array>
#include <cerrno>
#include <optional>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

constexpr std::string_view in_command_line = "    # in the kernel's command line, then reboot";

// The cores that are left for the rest of the machine: none where the loop has them all. Nothing: it does not
// show.
std::optional<cpu_list> cpus_left(const machine& on) {
  const reading online = on.files.read("/sys/devices/system/cpu/online");
  const auto all = cpu_list::of_list(online.text);
  if (!all || all->empty()) return std::nullopt;
  return all->without(on.cpus);
}

// Whether the chosen cores are all among `some`.
finding among(const machine& on, const cpu_list& some, level otherwise, std::string_view parameter) {
  finding result{.mark = some.contains_all(on.cpus) ? level::ok : otherwise,
                 .found = some.empty() ? std::string{"none"} : joined("cpu ", some.text())};
  const cpu_list missing = on.cpus.without(some);
  if (!some.empty() && !missing.empty()) result.found.append(joined(", but not ", missing.text()));
  const auto left = cpus_left(on);
  if (left && !left->empty()) result.commands = {joined(parameter, "=", on.cpus.text(), in_command_line)};
  return result;
}

// What a parameter of the kernel's command line says; the last one counts.
std::string_view parameter_of(std::string_view command_line, std::string_view name) {
  std::string_view said;
  for (const std::string_view word : words_of(command_line)) {
    if (word.starts_with(name) && word.substr(name.size()).starts_with('='))
      said = word.substr(name.size() + 1);
  }
  return said;
}

finding isolation(const machine& on) {
  constexpr std::string_view path = "/sys/devices/system/cpu/isolated";
  const reading at_boot = on.files.read(path);
  const reading in_group = on.files.read("/sys/fs/cgroup/cpuset.cpus.isolated"); // partitions, cgroup v2
  if (!at_boot && !in_group) return unseen(path, at_boot.error);
  const auto booted = cpu_list::of_list(at_boot.text);
  const auto grouped = cpu_list::of_list(in_group.text);
  std::vector<int> cpus;
  if (booted) cpus.insert(cpus.end(), booted->begin(), booted->end());
  if (grouped) cpus.insert(cpus.end(), grouped->begin(), grouped->end());
  return among(on, cpu_list{std::move(cpus)}, level::warn, "isolcpus");
}

finding tick(const machine& on) {
  constexpr std::string_view path = "/sys/devices/system/cpu/nohz_full";
  const reading file = on.files.read(path);
  // The file is there in kernels that can do it; without the parameter it is empty or says "(null)".
  if (file) return among(on, cpu_list::of_list(file.text).value_or(cpu_list{}), level::info, "nohz_full");
  if (!on.files.exists("/sys/devices/system/cpu/isolated")) return unseen(path, file.error);
  return {.mark = level::info, .found = "none (this kernel cannot: CONFIG_NO_HZ_FULL)"};
}

finding callbacks(const machine& on) {
  const reading line = on.files.read("/proc/cmdline");
  if (!line) return unseen("/proc/cmdline", line.error);
  std::string_view said = parameter_of(line.text, "rcu_nocbs");
  if (said.empty()) said = parameter_of(line.text, "nohz_full"); // implies it
  if (said == "all") return {.found = "all"};
  return among(on, cpu_list::of_list(said).value_or(cpu_list{}), level::info, "rcu_nocbs");
}

finding interrupts(const machine& on) {
  finding result;
  std::size_t seen = 0;
  std::vector<std::string> here;
  for (const std::string& number : on.files.names_in("/proc/irq")) {
    const auto cpus = interrupt_cpus(on.files, number);
    if (!cpus) continue;
    ++seen;
    if (!cpus->both(on.cpus).empty()) here.push_back(number);
  }
  if (seen == 0) return unseen("/proc/irq", ENOENT);
  result.values = {{"interrupts_here", static_cast<std::int64_t>(here.size())},
                   {"interrupts", static_cast<std::int64_t>(seen)}};
  result.found = joined(here.size(), " of ", seen, " go to cpu ", on.cpus.text());
  const reading mask = on.files.read("/proc/irq/default_smp_affinity");
  const auto by_default = cpu_list::of_mask(mask.text);
  const bool new_ones_too = by_default && !by_default->both(on.cpus).empty();
  if (new_ones_too) result.found.append(", and new ones may");
  if (!here.empty()) {
    result.mark = level::warn;
  } else if (new_ones_too) {
    result.mark = level::info;
  }
  const auto others = cpus_left(on);
  if (others && others->empty()) {
    result.found.append("; no other core is left for them");
  } else if (others) {
    result.commands.push_back(
        joined("for i in /proc/irq/*/smp_affinity_list; do echo ", others->text(), " > $i; done"));
    result.commands.push_back(joined("irqaffinity=", others->text(), in_command_line));
  }
  return result;
}

finding irqbalance(const machine& on) {
  const auto running = processes(on.files, "irqbalance");
  if (!running) return processes_unseen();
  if (running->empty()) return {.found = "does not run"};
  const auto isolated = cpu_list::of_list(on.files.read("/sys/devices/system/cpu/isolated").text);
  if (isolated && isolated->contains_all(on.cpus)) {
    return {.mark = level::info, .found = "runs, and keeps off isolated cores unless told otherwise"};
  }
  return {.mark = level::warn, .found = "runs", .commands = {"systemctl disable --now irqbalance"}};
}

// clang-format off
constexpr std::array<check, 5> isolation_table{{
    {.name = "isolation", .title = "isolated cores", .wanted = "the loop's cores",
     .why = "the scheduler puts other threads on a core that is not isolated",
     .change = "isolcpus=, or a cpuset partition of type isolated", .examine = isolation},
    {.name = "tick", .title = "cores without a tick", .wanted = "the loop's cores",
     .why = "the kernel's tick interrupts the loop HZ times a second, for some microseconds",
     .change = "nohz_full= (it helps loops that spin more than loops that sleep)", .examine = tick},
    {.name = "callbacks", .title = "cores without RCU callbacks", .wanted = "the loop's cores",
     .why = "the kernel cleans up after others on the core where they were",
     .change = "rcu_nocbs= (nohz_full= implies it)", .examine = callbacks},
    {.name = "interrupts", .title = "interrupts", .wanted = "none on the loop's cores",
     .why = "an interrupt's handler comes before any thread, or as a thread of priority 50 with PREEMPT_RT",
     .change = "send them to other cores; those that a driver manages stay where they are",
     .examine = interrupts},
    {.name = "irqbalance", .title = "irqbalance", .wanted = "does not run",
     .why = "it moves interrupts back to cores that are not isolated",
     .change = "stop it, or ban the loop's cores in /etc/default/irqbalance", .examine = irqbalance},
}};
// clang-format on

} // namespace

std::span<const check> isolation_checks() { return isolation_table; }

} // namespace rowe::tools::fitness
