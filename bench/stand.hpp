// SPDX-License-Identifier: Apache-2.0
// The frame of a main that takes the options, pins this thread and says what machine it was; and what benches
// of two pinned threads stand on (two_cores.hpp).
#pragma once
#include <cstdio>
#include <string>

#include <benchmark/benchmark.h>

#include <rowe/rt/thread.hpp>

#include "two_cores.hpp"

namespace rowe::bench {

// The main of a bench: `measure(rounds)` runs all rounds and registers what they said.
template <class Measure>
int run_on_two_cores(const char* name, int count, char** arguments, Measure&& measure) {
  if (!choose_cores(name, count, arguments)) return 1;
  const int rounds = number_option(count, arguments, "rounds", 11);
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 1;
  (void)rt::prepare_this_thread({.name = "bench", .cpu = here}); // refused: the bench still runs

  benchmark::AddCustomContext("rounds", std::to_string(rounds));
  benchmark::AddCustomContext("cores", std::to_string(here) + " and " + std::to_string(there));
  benchmark::AddCustomContext("kernel", line_of("/proc/sys/kernel/osrelease"));
  benchmark::AddCustomContext("clock source",
                              line_of("/sys/devices/system/clocksource/clocksource0/current_clocksource"));
  benchmark::AddCustomContext("governor", line_of("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"));
  if (!measure(rounds)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

} // namespace rowe::bench
