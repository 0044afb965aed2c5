// SPDX-License-Identifier: Apache-2.0
#include "machine.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <set>

#include <rowe/rt/clock.hpp>

#include "../console.hpp"

namespace rowe::tools::bench {
namespace {

// Not more than the facts need; files of /proc have no size to ask for.
std::string text_of(const std::string& path) {
  std::ifstream file{path};
  return {std::istreambuf_iterator<char>{file}, {}};
}

// Of a file with one value; empty where there is none.
std::string value_of(const std::string& path) {
  std::ifstream file{path};
  std::string line;
  std::getline(file, line);
  while (!line.empty() && (line.back() == '\n' || line.back() == ' ' || line.back() == '\0')) line.pop_back();
  return line;
}

std::string or_else(std::string text, std::string_view otherwise) {
  return text.empty() ? std::string{otherwise} : text;
}

std::string real_time_of(const std::string& root, std::string_view version) {
  if (value_of(root + "sys/kernel/realtime") == "1") return "PREEMPT_RT";
  // The longer names first: PREEMPT is a part of both.
  for (const std::string_view kind : {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"}) {
    if (version.find(kind) != std::string_view::npos) return std::string{kind};
  }
  return "not preemptible";
}

std::string hypervisor_of(const std::string& root) {
  if (const std::string xen = value_of(root + "sys/hypervisor/type"); !xen.empty()) return xen;
  const std::string tree = value_of(root + "proc/device-tree/hypervisor/compatible");
  if (!tree.empty()) return tree.substr(0, tree.find('\0'));
  const std::string cpus = text_of(root + "proc/cpuinfo");
  const auto flags = cpus.find("\nflags");
  if (flags == std::string::npos) return "none";
  const std::string line = cpus.substr(flags + 1, cpus.find('\n', flags + 1) - flags - 1) + " ";
  if (line.find(" hypervisor ") == std::string::npos) return "none";
  return or_else(value_of(root + "sys/class/dmi/id/sys_vendor"), "yes");
}

// Of the CPUs that are used, all different ones.
std::string governor_of(const std::string& root, const std::vector<int>& cpus) {
  std::set<std::string> found;
  for (const int cpu : cpus) {
    const std::string name =
        value_of(joined(root, "sys/devices/system/cpu/cpu", cpu, "/cpufreq/scaling_governor"));
    if (!name.empty()) found.insert(name);
  }
  std::string all;
  for (const std::string& name : found) all.append(all.empty() ? "" : "/").append(name);
  return or_else(all, "none");
}

std::string cpu_name_of(const std::string& root) {
  const std::string board = value_of(root + "proc/device-tree/model");
  if (!board.empty()) return board.substr(0, board.find('\0'));
  const std::string cpus = text_of(root + "proc/cpuinfo");
  const auto name = cpus.find("model name");
  if (name == std::string::npos) return {};
  const auto begin = cpus.find(": ", name);
  return begin == std::string::npos ? "" : cpus.substr(begin + 2, cpus.find('\n', begin) - begin - 2);
}

void add_warnings(machine& m, const std::string& root) {
  const auto warn = [&m](auto&&... text) { m.warnings.push_back(joined(text...)); };
  if (!m.is_real_time()) warn("the kernel is not a real-time one: the largest samples are its own");
  if (m.hypervisor != "none") warn("a virtual machine: the host may take a CPU away at any time");
  if (m.governor != "none" && m.governor != "performance")
    warn("the governor is ", m.governor, ": the clock rate changes while we measure");
  const std::string share = value_of(root + "proc/sys/kernel/sched_rt_runtime_us");
  if (!share.empty() && share != "-1")
    warn("sched_rt_runtime_us is ", share,
         ": SCHED_FIFO threads that never sleep lose their CPU each second");
  if (m.clock.rfind("tsc", 0) != 0 && m.clock.rfind("arch_sys_counter", 0) != 0)
    warn("the clock source is ", m.clock, ": reading it is a system call");
}

} // namespace

std::string machine::line() const {
  return joined("Linux ", kernel, ", ", is_real_time() ? "" : "not real-time: ", real_time, "; ", processor,
                "; hypervisor ", hypervisor, "; governor ", governor, "; isolated CPUs ", isolated,
                "; clock ", clock, "; load ", load);
}

machine machine_at(const std::string& root, const std::vector<int>& cpus) {
  machine m;
  utsname names{};
  (void)::uname(&names);
  // A tree of its own brings these along, too: they stand in /proc as well.
  m.host = or_else(value_of(root + "proc/sys/kernel/hostname"), names.nodename);
  m.boot_id = value_of(root + "proc/sys/kernel/random/boot_id");
  m.kernel = or_else(value_of(root + "proc/sys/kernel/osrelease"), names.release);
  m.real_time = real_time_of(root, or_else(value_of(root + "proc/sys/kernel/version"), names.version));
  const std::string name = cpu_name_of(root);
  m.processor = joined(name, name.empty() ? "" : ", ", static_cast<const char*>(names.machine), ", ",
                       ::sysconf(_SC_NPROCESSORS_ONLN), " CPUs");
  m.governor = governor_of(root, cpus);
  m.isolated = or_else(value_of(root + "sys/devices/system/cpu/isolated"), "none");
  m.clock =
      or_else(value_of(root + "sys/devices/system/clocksource/clocksource0/current_clocksource"), "unknown");
  m.hypervisor = hypervisor_of(root);
  const std::string load = value_of(root + "proc/loadavg");
  m.load = or_else(load.substr(0, load.find(' ')), "unknown");
  add_warnings(m, root);
  return m;
}

machine this_machine(const std::vector<int>& cpus) {
  machine m = machine_at("/", cpus);
  m.clock.append(joined(", ", rt::clock_is_cheap().read.count(), " ns"));
  return m;
}

} // namespace rowe::tools::bench
