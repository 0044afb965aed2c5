// SPDX-License-Identifier: Apache-2.0
// Question: how soon does what a loop publishes arrive when the service thread waits by idle::phase, and for
// how much of a core?
//
// Measured: a thread on core A (--here) publishes a struct every millisecond and spins on a socket until that
// has it as a JSON frame: from the beginning of publish() to the frame, p50 (median over the rounds), p99 and
// p99.9 (of all rounds). The service thread is on core B (--there). With it: `core_percent`, what the service
// thread takes of its core; `wakeups_per_s`, how often it wakes; `hit_percent`, of the values how many came
// while it watched for them; `watched_percent`, of the time how much it watched. `of_spin` is the ratio of
// p50 to that of idle::spin inside each round (target: at most 1.5 at 10 % of a core).
//
// - arrives_spread_0, 20, 100, 300: each value is published late by so many microseconds at most, at random.
// - arrives_computes_200: the loop computes for 200 us between the time it reads and publishing.
// - arrives_drift: the loop's period is 1000.2 us, declared as 1 ms (200 ppm).
// - arrives_beating: a second topic, every 1003 us, whose values the same socket gets.
// - arrives_pause: after 100 values there are none for 50 ms.
// - arrives_quiet: nothing declares a period, so that nothing is known.
//
// idle::spin and idle::poll without a spread stand beside them.
//
// Excluded: a second machine; a thread that waits for the frame asleep. The loop's own lateness: it is awake
// 300 us before its times.
//
// What would make it lie: other load on either core; a machine that halts its cores (a virtual one above all:
// how late it wakes is what is watched for in vain).
//
// Run: bench_phase [--rounds=11] [--here=CPU] [--there=CPU] [--priority=50] [Google Benchmark's options]
// (SCHED_FIFO of both threads, where that is permitted; 0: ordinary ones)
#include <array>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/rowe.hpp>

#include "loop_stand.hpp"
#include "raw_client.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr int values = 250;          // in a round
constexpr int values_to_learn = 100; // before, untimed
constexpr int values_to_pause = 100;

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "bench_phase: %s\n", what);
  std::exit(1);
}

struct scenario {
  const char* name;
  idle policy = idle::phase;
  rt::duration spread{};
  rt::duration computes{};
  rt::duration real = 1ms;
  bool beats = false;
  bool pauses = false;
  bool declared = true;
};

constexpr scenario scenarios[] = {
    {.name = "arrives_spread_0/spin", .policy = idle::spin},
    {.name = "arrives_spread_0/poll", .policy = idle::poll},
    {.name = "arrives_spread_0/phase"},
    {.name = "arrives_spread_20/phase", .spread = 20us},
    {.name = "arrives_spread_100/phase", .spread = 100us},
    {.name = "arrives_spread_300/phase", .spread = 300us},
    {.name = "arrives_computes_200/phase", .computes = 200us},
    {.name = "arrives_drift/phase", .real = rt::duration{1'000'200}},
    {.name = "arrives_beating/phase", .beats = true},
    {.name = "arrives_pause/phase", .pauses = true},
    {.name = "arrives_quiet/phase", .declared = false},
};

struct figures {
  std::vector<double> p50, of_spin, core, hits, watched, wakeups;
  std::vector<double> all; // times, of all rounds
};

class run {
 public:
  explicit run(const scenario& of) : s_{of}, robot_{listen(of)}, client_{robot_.port()} {
    auto first = robot_.advertise<odometry>("/odom", {.period = s_.declared ? 1ms : 0ms});
    auto second = robot_.advertise<odometry>("/second", {.period = 1003us});
    if (!first || !second || !client_.ok()) give_up("cannot advertise, or connect");
    odom_ = std::move(*first);
    second_ = std::move(*second);
    subscribe("/odom");
    if (s_.beats) subscribe("/second");
    while (!odom_.wanted() || (s_.beats && !second_.wanted())) continue;
  }

  void measure(figures& into) {
    publish(values_to_learn);
    times_.clear();
    const service_usage before = service_usage::read();
    const double hits = count_of(robot_, "phase_hits"), misses = count_of(robot_, "phase_misses"),
                 watched = count_of(robot_, "phase_watched_ns");
    const auto begin = monotonic_clock::now();
    publish(values);
    const double seconds = nanoseconds_since(begin) / 1e9;
    const service_usage after = service_usage::read();
    const double hit = count_of(robot_, "phase_hits") - hits;
    const double all = hit + count_of(robot_, "phase_misses") - misses;
    into.hits.push_back(all > 0 ? 100 * hit / all : 0);
    into.watched.push_back((count_of(robot_, "phase_watched_ns") - watched) / seconds / 1e7);
    into.core.push_back(100 * (after.cpu_s - before.cpu_s) / seconds);
    into.wakeups.push_back((after.sleeps - before.sleeps) / seconds);
    into.all.insert(into.all.end(), times_.begin(), times_.end());
    into.p50.push_back(quantile(times_, 0.5));
  }

 private:
  static endpoint listen(const scenario& of) {
    auto robot = endpoint::listen(
        0, {.idle_policy = of.policy, .service_cpu = there, .service_priority = priority, .page = false});
    if (!robot) give_up("cannot listen");
    return std::move(*robot);
  }
  void subscribe(const std::string& topic) {
    if (!client_.send(
            raw_client::frame_of(wire::opcode::text, R"({"op":"subscribe","topic":")" + topic + "\"}")))
      give_up("cannot subscribe");
  }
  void publish_one(publisher<odometry>& on, rt::time_point when) {
    const auto late =
        rt::duration{std::uniform_int_distribution<std::int64_t>{0, s_.spread.count()}(chance_)};
    wait_until(when + late);
    const auto now = monotonic_clock::now();
    while (monotonic_clock::now() < now + s_.computes) continue;
    const auto begin = monotonic_clock::now();
    if (!on.publish({0.001, 1, 2, 3, 4}, now)) give_up("refused to publish");
    if (client_.take().empty()) give_up("disconnected");
    times_.push_back(nanoseconds_since(begin) / 1e3);
    client_.answer_pings();
  }
  void publish(int count) {
    auto next = monotonic_clock::now() + 1ms;
    auto next_of_second = next + 500us;
    for (int i = 0; i < count; ++i) {
      if (s_.beats && next_of_second < next) {
        publish_one(second_, next_of_second);
        next_of_second += 1003us;
        --i;
        continue;
      }
      publish_one(odom_, next);
      next += s_.real;
      if (s_.pauses && i % values_to_pause == values_to_pause - 1) next += 50ms;
    }
  }

  scenario s_;
  endpoint robot_;
  raw_client client_;
  publisher<odometry> odom_, second_;
  std::minstd_rand chance_{1};
  std::vector<double> times_;
};

void report(const scenario& of, figures& each) {
  benchmark::RegisterBenchmark(of.name,
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.p50) * 1e-6);
                                 state.counters["p50_us"] = median(each.p50);
                                 state.counters["p99_us"] = quantile(each.all, 0.99);
                                 state.counters["p999_us"] = quantile(each.all, 0.999);
                                 state.counters["of_spin"] = median(each.of_spin);
                                 state.counters["core_percent"] = median(each.core);
                                 state.counters["hit_percent"] = median(each.hits);
                                 state.counters["watched_percent"] = median(each.watched);
                                 state.counters["wakeups_per_s"] = median(each.wakeups);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::array<figures, std::size(scenarios)> all;
  read_priority(count, arguments);
  return run_on_two_cores("bench_phase", count, arguments, [&](int rounds) {
    take_priority();
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        run{scenarios[i]}.measure(all[i]);
        all[i].of_spin.push_back(all[i].p50.back() / all[0].p50.back());
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) report(scenarios[i], all[i]);
    return true;
  });
}
