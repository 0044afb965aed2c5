// SPDX-License-Identifier: Apache-2.0
// Rounds in which each way of writing or reading JSON runs once over all messages, on this thread's processor
// time. For json_write.cpp and json_read.cpp.
#pragma once
#include <ctime>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "json_messages.hpp"
#include "rounds.hpp"

namespace rowe::bench {

// One way of doing what its group is about: `GROUP/CONTENDER`.
struct way {
  std::string name;
  std::function<std::size_t(std::size_t)> run; // on the i-th message; returns bytes, or what must not be
                                               // left out; 0 where it refused
  struct ratio {
    std::string counter;
    std::string to;     // another way
    bool times = false; // the other's time in ours, for counters that say how many times as fast ours is
  };
  std::vector<ratio> ratios = {};
};

// The rounds, and what came of them.
class contest {
 public:
  explicit contest(std::vector<way> ways) : ways_{std::move(ways)}, seen_(ways_.size()) {}

  void run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      std::map<std::string, double> of;
      for (std::size_t i = 0; i < ways_.size(); ++i) {
        const double time = measure(i);
        of[ways_[i].name] = time;
        seen_[i].times.push_back(time);
      }
      for (std::size_t i = 0; i < ways_.size(); ++i) {
        for (const way::ratio& r : ways_[i].ratios) {
          const double ratio = of.at(ways_[i].name) / of.at(r.to);
          seen_[i].ratios[r.counter].push_back(r.times ? 1 / ratio : ratio);
        }
      }
    }
  }

  void report() {
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      benchmark::RegisterBenchmark(ways_[i].name.c_str(),
                                   [this, i](benchmark::State& state) {
                                     if (seen_[i].refused)
                                       return state.SkipWithError("a message was refused");
                                     for (auto _ : state)
                                       state.SetIterationTime(median(seen_[i].times) * 1e-9);
                                     state.counters["bytes"] = static_cast<double>(seen_[i].bytes);
                                     for (const auto& [name, values] : seen_[i].ratios)
                                       state.counters[name] = median(values);
                                   })
          ->Iterations(1)
          ->UseManualTime()
          ->Unit(benchmark::kNanosecond);
    }
  }

 private:
  struct seen {
    std::vector<double> times;
    std::map<std::string, std::vector<double>> ratios;
    std::size_t bytes = 0;
    bool refused = false;
  };

  static double cpu_time() {
    timespec t;
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e9 + static_cast<double>(t.tv_nsec);
  }

  // Nanoseconds for a message.
  double measure(std::size_t which) {
    constexpr int passes = 20; // over all messages
    const way& w = ways_[which];
    std::size_t sum = 0;
    const double begin = cpu_time();
    for (int pass = 0; pass < passes; ++pass) {
      for (std::size_t i = 0; i < messages; ++i) {
        const std::size_t bytes = w.run(i);
        benchmark::DoNotOptimize(bytes);
        sum += bytes;
        seen_[which].refused |= bytes == 0;
      }
    }
    const double elapsed = cpu_time() - begin;
    seen_[which].bytes = sum / (passes * messages);
    return elapsed / (passes * messages);
  }

  std::vector<way> ways_;
  std::vector<seen> seen_;
};

// The main of such a bench: `ways()` makes them, with all that they need.
template <class Ways>
int run_contest(int count, char** arguments, Ways&& ways) {
  const int rounds = number_option(count, arguments, "rounds", 11);
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 1;
  benchmark::AddCustomContext("rounds", std::to_string(rounds));
  benchmark::AddCustomContext("kernel", line_of("/proc/sys/kernel/osrelease"));
  contest all{ways()};
  all.run(rounds);
  all.report();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

} // namespace rowe::bench
