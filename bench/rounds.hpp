// SPDX-License-Identifier: Apache-2.0
// What comparing benches share: two cores to run on, and the statistics of rounds. Everything that is
// compared runs once in every round of one run, because the machine drifts from minute to minute; ratios are
// taken inside a round and their median over the rounds is what is reported, never a mean.
#pragma once
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sched.h>

namespace rowe::bench {

// The value below which `fraction` of the samples lie; reorders them. 0 without samples.
inline double quantile(std::vector<double>& samples, double fraction) {
  if (samples.empty()) return 0;
  const auto rank = static_cast<std::size_t>(fraction * static_cast<double>(samples.size() - 1) + 0.5);
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

inline double median(std::vector<double> samples) { return quantile(samples, 0.5); }

// The first and the last core this process may run on, as far apart as it can be; nothing if there is only
// one.
inline std::optional<std::pair<int, int>> two_cpus() {
  cpu_set_t allowed;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return std::nullopt;
  std::vector<int> cpus;
  for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) cpus.push_back(static_cast<int>(cpu));
  if (cpus.size() < 2) return std::nullopt;
  return std::pair{cpus.front(), cpus.back()};
}

// Takes `--name=value` out of the arguments; `otherwise` if it is not among them.
inline int number_option(int& count, char** arguments, std::string_view name, int otherwise) {
  const std::string prefix = "--" + std::string{name} + "=";
  for (int i = 1; i < count; ++i) {
    if (std::string_view{arguments[i]}.substr(0, prefix.size()) != prefix) continue;
    const int value = std::atoi(arguments[i] + prefix.size());
    std::move(arguments + i + 1, arguments + count, arguments + i);
    --count;
    return value;
  }
  return otherwise;
}

// The first line of a file of /proc or /sys, or "unknown".
inline std::string line_of(const char* path) {
  std::ifstream file{path};
  std::string line;
  return std::getline(file, line) ? line : "unknown";
}

} // namespace rowe::bench
