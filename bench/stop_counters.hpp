// SPDX-License-Identifier: Apache-2.0
// What benches on Google Benchmark report of the stop's figures.
#pragma once
#include <benchmark/benchmark.h>

#include "stand.hpp"
#include "stop_probe.hpp"

namespace rowe::bench {

inline void add_stop_counters(stop_figures& seen, benchmark::State& state) {
  for (auto _ : state) state.SetIterationTime(quantile(seen.trips, 0.5) * 1e-9);
  state.counters["p99_us"] = quantile(seen.trips, 0.99) / 1000;
  state.counters["p99.9_us"] = quantile(seen.trips, 0.999) / 1000;
  state.counters["max_us"] = quantile(seen.trips, 1) / 1000;
  state.counters["witness_gap_us"] = quantile(seen.gaps, 1) / 1000;
  state.counters["robot_p99.9_us"] = quantile(seen.robot, 0.999) / 1000;
  state.counters["robot_max_us"] = quantile(seen.robot, 1) / 1000;
  state.counters["cycle_max_us"] = quantile(seen.cycles, 1) / 1000;
  state.counters["woke_late_p99.9_us"] = quantile(seen.woke_late, 0.999) / 1000;
  state.counters["unanswered"] = static_cast<double>(seen.asked - seen.answered);
}

} // namespace rowe::bench
