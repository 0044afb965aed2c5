// SPDX-License-Identifier: Apache-2.0
#include "check.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>

#include "../rowe/console.hpp"

namespace rowe::tools::fitness {
namespace {

std::string_view reason_of(int error) {
  switch (error) {
  case ENOENT:
  case ENOTDIR: return "it is not there";
  case EACCES:
  case EPERM: return "not permitted; root may see it";
  default: return "it cannot be read";
  }
}

// What the kernel's files hold is anything; our own units have a "µ".
void to_plain(std::string& text) {
  constexpr std::string_view micro = "µ";
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.compare(i, micro.size(), micro) == 0) {
      i += micro.size() - 1;
    } else if (static_cast<unsigned char>(text[i]) >= 0x80) {
      text[i] = '?';
    }
  }
}

} // namespace

std::span<const group> groups() {
  static const std::array<group, 7> all{{{"kernel", kernel_checks()},
                                         {"permissions", permission_checks()},
                                         {"isolation", isolation_checks()},
                                         {"processor", processor_checks()},
                                         {"memory", memory_checks()},
                                         {"network", network_checks()},
                                         {"noise", noise_checks()}}};
  return all;
}

finding examine(const check& one, const machine& on) {
  finding result = one.examine(on);
  // Names of devices and programs may be any bytes; JSON and terminals take text.
  to_plain(result.found);
  for (std::string& command : result.commands) to_plain(command);
  if (!result.visible) result.mark = one.vital ? level::warn : level::info;
  if (result.mark == level::ok) result.commands.clear();
  return result;
}

finding unseen(std::string_view path, int error) {
  return {.found = joined("not visible here (", path, ": ", reason_of(error), ")"), .visible = false};
}

finding untried() { return {.found = "not visible here (it could not be tried)", .visible = false}; }

finding setting(const machine& on, std::string_view path, std::int64_t wanted, level otherwise) {
  const reading file = on.files.read(path);
  if (!file) return unseen(path, file.error);
  const auto number = on.files.number(path);
  if (!number) return {.found = joined("not visible here (", path, " holds no number)"), .visible = false};
  std::string name{path.substr(std::string_view{"/proc/sys/"}.size())};
  std::ranges::replace(name, '/', '.');
  return {.mark = *number == wanted ? level::ok : otherwise,
          .found = std::to_string(*number),
          .commands = {joined("sysctl -w ", name, "=", wanted)},
          .values = {{"value", *number}}};
}

std::string cpu_path(int cpu, std::string_view part) {
  return joined("/sys/devices/system/cpu/cpu", cpu, "/", part);
}

std::optional<cpu_list> interrupt_cpus(const facts& files, std::string_view number) {
  for (const std::string_view name : {"effective_affinity_list", "smp_affinity_list"}) {
    const reading file = files.read(joined("/proc/irq/", number, "/", name));
    if (!file || file.text.empty()) continue;
    if (auto cpus = cpu_list::of_list(file.text)) return cpus;
  }
  return std::nullopt;
}

bool machine_shows(const facts& files) { return files.read("/proc/2/comm").text == "kthreadd"; }

std::optional<std::vector<std::string>> processes(const facts& files, std::string_view name) {
  if (!machine_shows(files)) return std::nullopt;
  std::vector<std::string> found = files.names_in("/proc");
  std::erase_if(found, [&](const std::string& number) {
    return number.find_first_not_of("0123456789") != std::string::npos ||
           !files.read(joined("/proc/", number, "/comm")).text.starts_with(name);
  });
  return found;
}

finding processes_unseen() {
  return {.found = "not visible here (the machine's processes do not show)", .visible = false};
}

bool linux_at_least(const facts& files, int major, int minor) {
  const reading version = files.read("/proc/version");
  constexpr std::string_view before = "Linux version ";
  if (!version.text.starts_with(before)) return false;
  const char* const end = version.text.data() + version.text.size();
  int has_major = 0;
  int has_minor = 0;
  const auto dot = std::from_chars(version.text.data() + before.size(), end, has_major);
  if (dot.ec != std::errc{} || dot.ptr == end || *dot.ptr != '.') return false;
  if (std::from_chars(dot.ptr + 1, end, has_minor).ec != std::errc{}) return false;
  return has_major > major || (has_major == major && has_minor >= minor);
}

std::string time_text(rt::duration time) {
  static constexpr std::array<std::string_view, 4> units{"ns", "µs", "ms", "s"};
  auto number = static_cast<double>(time.count());
  std::size_t unit = 0;
  for (; number >= 1000 && unit + 1 < units.size(); ++unit) number /= 1000;
  std::array<char, 32> digits;
  const int decimals = unit == 0 || number >= 10 ? 0 : 1;
  const int length = std::snprintf(digits.data(), digits.size(), "%.*f", decimals, number);
  return joined(std::string_view{digits.data(), static_cast<std::size_t>(length)}, " ", units[unit]);
}

} // namespace rowe::tools::fitness
