// SPDX-License-Identifier: Apache-2.0
// What the network does on the loop's cores, and how long it sits on what came in.
#include <algorithm>
#include <array>
#include <cerrno>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

// Interfaces with a device behind them.
std::vector<std::string> interfaces(const machine& on) {
  std::vector<std::string> names = on.files.names_in("/sys/class/net");
  std::erase_if(names, [&](const std::string& name) {
    return !on.files.exists(joined("/sys/class/net/", name, "/device"));
  });
  return names;
}

// Whether an interrupt belongs to an interface: it is one of its device's message interrupts, or is named
// after it ("eth0-rx-3") or after its device ("virtio2-input.0").
bool belongs_to(const machine& on, const std::string& number, const std::string& interface) {
  const std::string folder = joined("/sys/class/net/", interface, "/device");
  if (on.files.exists(joined(folder, "/msi_irqs/", number))) return true;
  const std::string device = on.files.target_of(folder);
  return std::ranges::any_of(on.files.names_in(joined("/proc/irq/", number)), [&](const std::string& action) {
    return holds(action, interface) || (!device.empty() && action.starts_with(device));
  });
}

finding adapter_interrupts(const machine& on) {
  if (!on.files.exists("/sys/class/net")) return unseen("/sys/class/net", ENOENT);
  finding result;
  std::size_t seen = 0;
  for (const std::string& interface : interfaces(on)) {
    for (const std::string& number : on.files.names_in("/proc/irq")) {
      if (!belongs_to(on, number, interface)) continue;
      ++seen;
      const auto cpus = interrupt_cpus(on.files, number);
      if (!cpus || cpus->both(on.cpus).empty()) continue;
      result.mark = level::warn;
      result.found.append(
          joined(result.found.empty() ? "" : ", ", interface, ": ", number, " on cpu ", cpus->text()));
      result.commands.push_back(joined("echo CPU > /proc/irq/", number, "/smp_affinity_list"));
    }
  }
  if (seen == 0) {
    return {.found = "not visible here (no interface shows its interrupts)", .visible = false};
  }
  if (result.found.empty()) result.found = joined("none of ", seen);
  return result;
}

finding coalescing(const machine& on) {
  constexpr rt::duration much = std::chrono::microseconds{50};
  finding result;
  bool any = false;
  for (const std::string& interface : interfaces(on)) {
    const auto time = on.trial.coalescing(interface);
    if (!time) continue;
    any = true;
    result.found.append(joined(result.found.empty() ? "" : ", ", interface, ": ", time_text(*time)));
    if (*time <= rt::duration{0}) continue;
    result.mark = std::max(result.mark, *time > much ? level::warn : level::info);
    result.commands.push_back(joined("ethtool -C ", interface, " adaptive-rx off rx-usecs 0"));
  }
  if (!any) return {.found = "not visible here (no interface reports it)", .visible = false};
  return result;
}

finding busy_poll(const machine& on) { return setting(on, "/proc/sys/net/core/busy_poll", 0, level::info); }

finding autocorking(const machine& on) {
  return setting(on, "/proc/sys/net/ipv4/tcp_autocorking", 0, level::info);
}

// clang-format off
constexpr std::array<check, 4> network_table{{
    {.name = "network_interrupts", .title = "network interrupts", .wanted = "none on the loop's cores",
     .why = "the core that takes a packet's interrupt also does the network's work for it",
     .change = "send them to the core of the service thread", .examine = adapter_interrupts},
    {.name = "coalescing", .title = "interrupt coalescing", .wanted = "0",
     .why = "received packets wait this long for more of them", .change = "switch it off, for more interrupts",
     .examine = coalescing},
    {.name = "busy_poll", .title = "busy polling", .wanted = "0",
     .why = "threads that wait for sockets spin this many microseconds first: quicker, and a busier core",
     .change = "as you like; off is the default", .examine = busy_poll},
    {.name = "autocorking", .title = "automatic corking of TCP", .wanted = "0",
     .why = "a small message may wait until the one before it has left the network card",
     .change = "switch it off where small messages must not wait", .examine = autocorking},
}};
// clang-format on

} // namespace

std::span<const check> network_checks() { return network_table; }

} // namespace rowe::tools::fitness
