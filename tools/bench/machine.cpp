// SPDX-License-Identifier: Apache-2.0
#include "machine.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <set>

#include <rowe/rt/clock.hpp>

#include "../doctor/facts.hpp"
#include "../rowe/console.hpp"

namespace rowe::tools::bench {
namespace {

std::string or_else(std::string text, std::string_view otherwise) {
  return text.empty() ? std::string{otherwise} : text;
}

std::string real_time_of(const fitness::facts& files, std::string_view version) {
  if (files.read("/sys/kernel/realtime").text == "1") return "PREEMPT_RT";
  // The longer names first: PREEMPT is a part of both.
  for (const std::string_view kind : {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"}) {
    if (version.find(kind) != std::string_view::npos) return std::string{kind};
  }
  return "not preemptible";
}

std::string hypervisor_of(const fitness::facts& files) {
  if (const std::string xen = files.read("/sys/hypervisor/type").text; !xen.empty()) return xen;
  const std::string tree = files.read("/proc/device-tree/hypervisor/compatible").text;
  if (!tree.empty()) return tree.substr(0, tree.find('\0'));
  const std::string cpus = files.read("/proc/cpuinfo").text;
  const auto flags = cpus.find("\nflags");
  if (flags == std::string::npos) return "none";
  const std::string line = cpus.substr(flags + 1, cpus.find('\n', flags + 1) - flags - 1) + " ";
  if (line.find(" hypervisor ") == std::string::npos) return "none";
  return or_else(files.read("/sys/class/dmi/id/sys_vendor").text, "yes");
}

// Of the CPUs that are used, all different ones.
std::string governor_of(const fitness::facts& files, const std::vector<int>& cpus) {
  std::set<std::string> found;
  for (const int cpu : cpus) {
    const std::string name =
        files.read(joined("/sys/devices/system/cpu/cpu", cpu, "/cpufreq/scaling_governor")).text;
    if (!name.empty()) found.insert(name);
  }
  std::string all;
  for (const std::string& name : found) all.append(all.empty() ? "" : "/").append(name);
  return or_else(all, "none");
}

std::string cpu_name_of(const fitness::facts& files) {
  const std::string board = files.read("/proc/device-tree/model").text;
  if (!board.empty()) return board.substr(0, board.find('\0'));
  const std::string cpus = files.read("/proc/cpuinfo").text;
  const auto name = cpus.find("model name");
  if (name == std::string::npos) return {};
  const auto begin = cpus.find(": ", name);
  return begin == std::string::npos ? "" : cpus.substr(begin + 2, cpus.find('\n', begin) - begin - 2);
}

void add_warnings(machine& m, const fitness::facts& files) {
  const auto warn = [&m](auto&&... text) { m.warnings.push_back(joined(text...)); };
  if (!m.is_real_time()) warn("the kernel is not a real-time one: the largest samples are its own");
  if (m.hypervisor != "none") warn("a virtual machine: the host may take a CPU away at any time");
  if (m.governor != "none" && m.governor != "performance")
    warn("the governor is ", m.governor, ": the clock rate changes while we measure");
  const std::string share = files.read("/proc/sys/kernel/sched_rt_runtime_us").text;
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
  const fitness::facts files{root};
  machine m;
  utsname names{};
  (void)::uname(&names);
  // A tree of its own brings these along, too: they stand in /proc as well.
  m.host = or_else(files.read("/proc/sys/kernel/hostname").text, names.nodename);
  m.boot_id = files.read("/proc/sys/kernel/random/boot_id").text;
  m.kernel = or_else(files.read("/proc/sys/kernel/osrelease").text, names.release);
  m.real_time = real_time_of(files, or_else(files.read("/proc/sys/kernel/version").text, names.version));
  const std::string name = cpu_name_of(files);
  m.processor = joined(name, name.empty() ? "" : ", ", static_cast<const char*>(names.machine), ", ",
                       ::sysconf(_SC_NPROCESSORS_ONLN), " CPUs");
  m.governor = governor_of(files, cpus);
  m.isolated = or_else(files.read("/sys/devices/system/cpu/isolated").text, "none");
  m.clock =
      or_else(files.read("/sys/devices/system/clocksource/clocksource0/current_clocksource").text, "unknown");
  m.hypervisor = hypervisor_of(files);
  const std::string load = files.read("/proc/loadavg").text;
  m.load = or_else(load.substr(0, load.find(' ')), "unknown");
  add_warnings(m, files);
  return m;
}

machine this_machine(const std::vector<int>& cpus) {
  machine m = machine_at("", cpus);
  m.clock.append(joined(", ", rt::clock_is_cheap().read.count(), " ns"));
  return m;
}

} // namespace rowe::tools::bench
