// SPDX-License-Identifier: Apache-2.0
// What kind of kernel this is, on what kind of machine, and what its clock is worth.
#include <algorithm>
#include <array>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

// Debian's; boards with a kernel of their own have their own way.
std::vector<std::string> installing_one(const machine& on, std::string_view version) {
  if (holds(version, "rpi")) return {};
  const reading cpus = on.files.read("/proc/cpuinfo");
  const bool arm = !entry_of(cpus.text, "Features").empty();
  return {joined("apt install linux-image-rt-", arm ? "arm64" : "amd64", " && reboot")};
}

finding preempt_rt(const machine& on) {
  const bool says_so = on.files.number("/sys/kernel/realtime") == 1;
  const reading version = on.files.read("/proc/version");
  if (!version && !says_so) return unseen("/proc/version", version.error);
  const bool named = holds(version.text, "PREEMPT_RT") || holds(version.text, "PREEMPT RT");
  if (says_so || named) return {.found = "PREEMPT_RT"};
  std::string model = "no preemption model named";
  for (const std::string_view word : words_of(version.text)) {
    if (word.starts_with("PREEMPT")) model = word;
  }
  return {.mark = level::fail, .found = model, .commands = installing_one(on, version.text)};
}

// Vendors under which hypervisors show themselves where they have a BIOS.
constexpr std::array<std::string_view, 9> hypervisors{
    "QEMU", "VMware", "innotek", "Xen", "Parallels", "Amazon EC2", "Google", "OpenStack", "Microsoft"};

finding virtual_machine(const machine& on) {
  const reading cpus = on.files.read("/proc/cpuinfo");
  const reading vendor = on.files.read("/sys/class/dmi/id/sys_vendor");
  const reading product = on.files.read("/sys/class/dmi/id/product_name");
  const auto flags = words_of(entry_of(cpus.text, "flags"));
  if (std::ranges::find(flags, "hypervisor") != flags.end())
    return {.mark = level::warn, .found = "a hypervisor"};
  const bool known = std::ranges::any_of(hypervisors, [&](std::string_view name) {
    const bool laptop = name == "Microsoft" || name == "Google"; // they make machines of metal, too
    return vendor.text.starts_with(name) &&
           (!laptop || holds(product.text, "Virtual") || holds(product.text, "Compute Engine"));
  });
  if (known) return {.mark = level::warn, .found = joined("a hypervisor (", vendor.text, ")")};
  if (on.files.exists("/proc/device-tree/hypervisor")) {
    return {.mark = level::warn, .found = "a hypervisor (named by the device tree)"};
  }
  const reading model = on.files.read("/proc/device-tree/model");
  // x86 tells by the flag; elsewhere somebody else has to name the machine.
  if (model) return {.found = joined("none (", model.text, ")")};
  if (!flags.empty() || vendor) return {.found = "none"};
  return unseen("/proc/cpuinfo", cpus.error);
}

finding container(const machine& on) {
  finding result{.mark = level::info, .found = "no sign of one"};
  for (const std::string_view sign : {"/.dockerenv", "/run/.containerenv", "/run/systemd/container"}) {
    if (!on.files.exists(sign)) continue;
    // A machine may be started from the image of a container.
    result.found = machine_shows(on.files) ? joined("perhaps (", sign, ", but the kernel's threads show)")
                                           : joined("yes (", sign, ")");
  }
  return result;
}

finding timers(const machine& on) {
  const auto grain = on.trial.timers();
  if (!grain) return untried();
  finding result;
  result.values = {{"resolution_ns", grain->resolution.count()}, {"tick_ns", grain->tick.count()}};
  const auto hertz =
      grain->tick.count() > 0 ? (1'000'000'000 + grain->tick.count() / 2) / grain->tick.count() : 0;
  result.found = joined(time_text(grain->resolution), ", HZ ", hertz);
  if (grain->resolution > std::chrono::microseconds{1}) result.mark = level::fail;
  return result;
}

finding clock_source(const machine& on) {
  constexpr std::string_view path = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
  const reading source = on.files.read(path);
  const auto cost = on.trial.clock();
  if (!cost) return untried();
  finding result;
  result.values = {{"read_ns", cost->read.count()}, {"system_call_ns", cost->system_call.count()}};
  result.commands = {joined("echo tsc > ", path), "dmesg | grep -i clocksource    # why it took another"};
  result.visible = static_cast<bool>(source) || cost->enters_kernel();
  result.found =
      joined(source ? std::string_view{source.text} : "the source is not visible here", ", ",
             time_text(cost->read), " a read", cost->enters_kernel() ? ": a system call" : " (vDSO)");
  if (cost->enters_kernel()) {
    result.mark = level::fail;
  } else if (source.text != "tsc" && source.text != "arch_sys_counter") {
    result.mark = level::warn;
  }
  return result;
}

// clang-format off
constexpr std::array<check, 5> kernel_table{{
    {.name = "preempt_rt", .title = "real-time kernel", .wanted = "PREEMPT_RT",
     .why = "other kernels delay a loop by milliseconds, in drivers, softirqs and spinlocks",
     .change = "install a PREEMPT_RT kernel and reboot", .vital = true, .examine = preempt_rt},
    {.name = "virtual_machine", .title = "virtual machine", .wanted = "none",
     .why = "the hypervisor takes cores away, unseen from inside",
     .change = "measure and run on real hardware; or pin the virtual cores and isolate them on the host",
     .examine = virtual_machine},
    {.name = "container", .title = "container", .wanted = "either",
     .why = "a container shares the host's kernel: tune the host, grant the container its rights",
     .change = "docker run --cap-add SYS_NICE --cap-add IPC_LOCK --ulimit rtprio=90 --ulimit memlock=-1",
     .examine = container},
    {.name = "timers", .title = "high-resolution timers", .wanted = "1 ns",
     .why = "without them a loop wakes up on the kernel's tick only",
     .change = "a kernel with CONFIG_HIGH_RES_TIMERS, started without highres=off and nohz=off",
     .vital = true, .examine = timers},
    {.name = "clock_source", .title = "clock", .wanted = "tsc or arch_sys_counter, in the vDSO",
     .why = "a loop reads the clock in each cycle, and a system call there has no bound",
     .change = "choose the clock source tsc (arch_sys_counter on ARM)", .vital = true,
     .examine = clock_source},
}};
// clang-format on

} // namespace

std::span<const check> kernel_checks() { return kernel_table; }

} // namespace rowe::tools::fitness
