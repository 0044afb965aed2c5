// SPDX-License-Identifier: Apache-2.0
// What the modes of `rowe bench` accept: each takes what all have in common, and adds its own.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/options.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "../rowe/arguments/command_line.hpp"
#include "../rowe/console.hpp"

namespace rowe::tools::bench {

// In rowe::idle's order.
inline constexpr std::array<std::string_view, 4> idle_names{"poll", "spin", "wake", "phase"};
inline constexpr rt::duration run_time_default = std::chrono::seconds{10};
inline constexpr rt::duration warm_up_default = std::chrono::milliseconds{200};
inline constexpr double rate_default = 1000; // Hz
inline constexpr double rate_max = 1'000'000;
inline constexpr std::uint64_t samples_max = 100'000'000; // a mark of one byte is kept for each
inline constexpr std::int64_t size_min = 64;              // bytes of a message
inline constexpr std::int64_t size_max = 60'000;
inline constexpr std::uint32_t in_flight_max = 64;           // messages of one kind between an end's threads
inline constexpr std::uint32_t reports_in_flight_max = 4096; // of those that are a few bytes long

// Where an end of the measurement runs.
struct placement {
  std::optional<int> user;    // the CPU of the thread that measures, or answers
  std::optional<int> service; // of its endpoint's service thread
  int priority = 0;           // SCHED_FIFO of the user's thread; the service thread has one less

  // A thread that never sleeps needs a CPU that nobody else uses.
  bool own_cpus() const noexcept { return user && service && *user != *service; }
  rt::thread_options user_thread(std::string_view name) const noexcept {
    return {.name = name, .cpu = user, .priority = priority};
  }
  std::string text() const; // "cpu 2 and 3, SCHED_FIFO 80 and 79"
};

struct settings {
  std::string mode; // "rpc"
  std::string url;  // of the peer; empty: one is started
  std::optional<rt::duration> run_time;
  std::optional<rt::duration> warm_up;
  std::optional<double> rate;
  std::int64_t size = 128; // of a message; of a peer: of the largest
  std::size_t idle = 0;    // an index of idle_names
  std::string cpu, peer_cpu;
  std::int64_t priority = 0;
  std::optional<rt::duration> timeout;

  // Bounds that decide how the program ends.
  std::optional<rt::duration> max;
  std::vector<numbered_time> percentiles;

  std::string json, hgrm, svg, compare; // files; empty: not wanted
  bool quiet = false;

  // Read from the texts above.
  placement here, peer;

  rt::duration run_time_or_default() const noexcept { return run_time.value_or(run_time_default); }
  rt::duration warm_up_or_default() const noexcept { return warm_up.value_or(warm_up_default); }
  double rate_or_default() const noexcept { return rate.value_or(rate_default); }
  rowe::idle idle_policy() const noexcept { return static_cast<rowe::idle>(idle); }
  // Whether a thread that waits for the service thread may do so without sleeping.
  bool spins(const placement& end) const noexcept {
    return idle_policy() == rowe::idle::spin && end.own_cpus();
  }
  // What is above this one is kept with its time: --max, else the largest bound on a percentile.
  rt::duration listed_above() const noexcept;
  // Every CPU that is used, for the machine's line.
  std::vector<int> cpus() const;
  endpoint_options options_of(const placement& end) const;
  rowe::limits limits; // as the environment has them
};

// The entries of the tables.
std::vector<option> run_options(settings& s);     // how long, where
std::vector<option> message_options(settings& s); // how often, how large, with which policy, to whom
std::vector<option> bound_options(settings& s);   // what decides
std::vector<option> output_options(settings& s);  // --json, --compare
std::vector<option> plot_options(settings& s);    // --hgrm, --svg

// Reads the rest of what was given. Empty: all is well; else what is wrong, as a sentence.
std::string complete(settings& s);

// "2" or "2,3".
std::string placement_of(std::string_view text, std::string_view name, placement& into);

} // namespace rowe::tools::bench
