// SPDX-License-Identifier: Apache-2.0
// A check of the doctor: what it looks at, what it wants to see, and why. Each group of them is a table in a
// file of its own; the verb goes through the tables and prints.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "cpu_list.hpp"
#include "facts.hpp"
#include "trials.hpp"

namespace rowe::tools::fitness {

// `fail`: what rowe promises a real-time loop does not hold here. `warn`: it holds, later than it could.
enum class level : std::uint8_t { ok, info, warn, fail };

// A number of a finding, for programs; its unit is in its name.
struct value {
  std::string_view name;
  std::int64_t number;
};

struct finding {
  level mark = level::ok;
  std::string found = {};
  bool visible = true; // false: nobody could tell, so `mark` says nothing about the machine
  std::vector<std::string> commands = {}; // that would change it, as root
  std::vector<value> values = {};
  std::string details = {}; // more lines, for people
};

// What is examined.
struct machine {
  const facts& files;
  trials& trial;
  cpu_list cpus;             // those that the loop is to run on
  rt::duration self_test{};  // how long; zero: not at all
  std::string certificate{}; // a file; empty: there is none to examine
};

struct check {
  std::string_view name;   // in --json; it stays
  std::string_view title;  // what is looked at
  std::string_view wanted; // a phrase
  std::string_view why;    // what happens otherwise
  std::string_view change; // a phrase for people; finding::commands has the letters
  bool vital = false;      // it can fail, so not to see it is worth a warning
  finding (*examine)(const machine&) = nullptr;
};

struct group {
  std::string_view name;
  std::span<const check> checks;
};

// All of them, in the order in which they are printed.
std::span<const group> groups();
// Where there is one to examine.
group certificate_group();

std::span<const check> kernel_checks();
std::span<const check> permission_checks();
std::span<const check> isolation_checks();
std::span<const check> processor_checks();
std::span<const check> memory_checks();
std::span<const check> network_checks();
std::span<const check> noise_checks();

// What a check does, with what follows from not seeing.
finding examine(const check& one, const machine& on);

// ---- for the checks

// Nobody could tell: `path` cannot be read, or no trial was made.
finding unseen(std::string_view path, int error);
finding untried();

// A number in /proc/sys: `wanted` is ok, anything else `otherwise`, with the command that sets it.
finding setting(const machine& on, std::string_view path, std::int64_t wanted, level otherwise);

// "/sys/devices/system/cpu/cpu3/PART".
std::string cpu_path(int cpu, std::string_view part);

// Where an interrupt goes: there where it was put, else wherever it may.
std::optional<cpu_list> interrupt_cpus(const facts& files, std::string_view number);

// Whether the machine's processes show here, and not only those of a container: the kernel's own do.
bool machine_shows(const facts& files);

// The numbers of the machine's processes whose names begin so. Nothing: they do not show here.
std::optional<std::vector<std::string>> processes(const facts& files, std::string_view name);
finding processes_unseen();

// Whether a text holds another.
inline bool holds(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

// The kernel's version is at least this one. False also when it is not known.
bool linux_at_least(const facts& files, int major, int minor);

// "3 µs", "1.25 ms".
std::string time_text(rt::duration time);

} // namespace rowe::tools::fitness
