// SPDX-License-Identifier: Apache-2.0
// What no file tells and has to be tried: whether this process gets a priority and locked memory, what the
// clock costs, how late a thread wakes up. Two ways to know: on this machine (machine_trials) and as written
// down for another one (recorded_trials), beside its files.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "cpu_list.hpp"
#include "facts.hpp"

namespace rowe::tools::fitness {

// How finely timers can be set, and how often the kernel's tick comes.
struct timer_grain {
  rt::duration resolution{}; // of high-resolution timers: 1 ns; without them the tick's length
  rt::duration tick{};
};

// How late a thread woke up that slept until fixed times.
struct wake_ups {
  int cpu = 0;
  int refused = 0;   // errno: it was not allowed to this cpu, and nothing was measured
  bool fifo = false; // with SCHED_FIFO
  bool cut_short = false;
  std::uint64_t count = 0;
  rt::duration min{}, p50{}, p99{}, max{};
  std::string bars; // the histogram, for people
};

// Each answer may be missing: then nobody tried.
class trials {
 public:
  static constexpr int priority = 80;

  trials() = default;
  trials(const trials&) = delete;
  trials& operator=(const trials&) = delete;
  virtual ~trials() = default;

  virtual std::optional<rt::grant> fifo() = 0; // for a thread, with `priority`
  virtual std::optional<rt::grant> lock(std::size_t bytes) = 0;
  virtual std::optional<rt::grant> lock_everything() = 0; // mlockall
  virtual std::optional<rt::clock_cost> clock() = 0;
  virtual std::optional<timer_grain> timers() = 0;
  // How long a network interface gathers what came in before it interrupts.
  virtual std::optional<rt::duration> coalescing(const std::string& interface) = 0;
  // On all of these at the same time, for so long.
  virtual std::vector<wake_ups> sleep_and_wake(const cpu_list& cpus, rt::duration for_so_long) = 0;
};

std::unique_ptr<trials> machine_trials();

// From the file `trials` of the folder: a line for each answer, its name and its numbers. "fifo 1" is errno
// 1, "fifo 0" granted.
//
//   fifo ERRNO               lock_bytes_max BYTES     lock_everything ERRNO     clock READ_NS SYSTEM_CALL_NS
//   timers RESOLUTION_NS TICK_NS                      coalescing INTERFACE MICROSECONDS
//   wake_ups CPU FIFO COUNT MIN_NS P50_NS P99_NS MAX_NS
std::unique_ptr<trials> recorded_trials(const facts& of);

} // namespace rowe::tools::fitness
