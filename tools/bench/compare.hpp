// SPDX-License-Identifier: Apache-2.0
// Before and after, as a table that can be pasted into an issue.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "report.hpp"

namespace rowe::tools::bench {

struct bucket {
  std::uint64_t lowest_ns;
  std::uint64_t highest_ns;
  std::uint64_t count;
};

// What an earlier run wrote with --json.
struct earlier {
  std::string mode;
  std::string machine; // its line
  std::vector<setting> settings;
  std::vector<std::pair<std::string, double>> numbers; // by their keys: "p99_ns", "figures.poll.no_peer..."
  std::vector<bucket> buckets;

  std::optional<double> number(std::string_view key) const;
};

// Nothing: `wrong` says why.
std::optional<earlier> read_earlier(const std::string& file, std::string& wrong);
std::optional<earlier> earlier_of(std::string_view json);

// Both machines, what was set up differently, and each number with its ratio.
std::string comparison_of(const earlier& before, const report& after);

} // namespace rowe::tools::bench
