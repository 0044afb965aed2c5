// SPDX-License-Identifier: Apache-2.0
// What a run came to, for people, for programs and for the exit code. The machine comes first in all of them.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "../rowe/exit_code.hpp"
#include "machine.hpp"
#include "pump.hpp"
#include "recording.hpp"
#include "settings.hpp"
#include "witness.hpp"

namespace rowe::tools::bench {

// How the run was set up: "rate", "1000 Hz". Two runs that differ here are two experiments.
struct setting {
  std::string name;
  std::string value;
};

// A part of what the samples are made of, or something measured beside them.
struct part {
  std::string name; // "robot: asked to accepted"
  std::string key;  // in JSON: "accepted"
  const rt::histogram* times;
};

// A number that is no latency: "poll_no_peer_wakeups_per_s".
struct figure {
  std::string key;
  std::string meaning; // "wake-ups/s, poll, no peer"
  double value;
};

struct bound {
  std::string name; // "max", "p99.9"
  rt::duration limit;
  rt::duration found;
  bool held() const noexcept { return found <= limit; }
};

struct report {
  std::string mode;     // "rpc"
  std::string measured; // what a sample is
  machine where;
  std::string peer; // the peer's machine, where that is another one
  std::vector<setting> settings;
  rt::duration ran{};
  pump_counts counts;
  const recording* samples = nullptr; // null: figures only
  std::vector<part> parts;
  std::vector<figure> figures;
  std::optional<thread_usage> usage; // of the measuring thread
  std::vector<bound> bounds;
  std::string problem; // what went wrong, as a sentence; empty where nothing did
};

// The percentiles that are always shown: 50, 90, 99, 99.9, 99.99.
inline constexpr double shown_percentiles[] = {50, 90, 99, 99.9, 99.99};

// "p99.9", and "p99_9" in JSON.
std::string percentile_name(double percent);
std::string percentile_key(double percent);
// "412 ns", "80.3 µs", "1.20 ms": three figures and the unit in which they are readable.
std::string time_text(rt::duration time);

// How `found` compares with what --max and --p... ask for.
std::vector<bound> bounds_of(const settings& asked, const rt::histogram& found);
// How the program ends: a bound that was exceeded weighs more than answers that did not come.
exit_code verdict_of(const report& r) noexcept;

std::string text_of(const report& r);
std::string json_of(const report& r);
// HdrHistogram's percentiles in microseconds, and the machine as a comment.
std::string hgrm_of(const report& r);

} // namespace rowe::tools::bench
