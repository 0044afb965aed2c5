// SPDX-License-Identifier: Apache-2.0
// Question: what does each idle policy of the service thread cost while nothing happens, and what does it
// bring a loop?
//
// Measured, for each policy: `cpu_percent`, what the service thread uses of a core, and `wakeups_per_s`, how
// often it wakes (how often it gave its core up by itself), over all rounds:
// - idle_no_peer: an endpoint that has a publisher, and no peer;
// - idle_quiet_peer: with a peer that is merely connected;
// - idle_listening_peer: with one that listens to the publisher's topic, on which nothing is published;
// - loop_1khz: a loop publishes a struct every millisecond and looks without pause until its own subscription
// has it as text, so that a value goes into a queue pair, through the service thread's encoder, and back
// through another queue pair. Here also what the call publish(value, now) takes (publish_p50_us,
// publish_p99_us; under `wake` with its write to the eventfd), and from its beginning until try_take() has
// the value (p50_us, p99_us; medians over the rounds).
//
// The loop and whoever asks is on core A (--here), the service thread on core B (--there).
//
// Excluded: sockets; a peer's share is the same under all policies (bench_phase has it for `phase`).
//
// What would make it lie: other load on either core; a machine that halts its cores (a virtual one above
// all), where waking costs ten times what it does where a core sleeps lightly.
//
// Run: bench_idle_policies [--rounds=11] [--here=CPU] [--there=CPU] [--priority=50] [Google Benchmark's
// options] (SCHED_FIFO of both threads, where that is permitted; 0: ordinary ones)
#include <array>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/rowe.hpp>

#include "loop_stand.hpp"
#include "raw_client.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr auto settling = 50ms; // what belongs to connecting and learning is over then
constexpr auto idle_time = 200ms;
constexpr auto loop_time = 300ms;
constexpr auto period = 1ms;

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "bench_idle_policies: %s\n", what);
  std::exit(1);
}

struct policy {
  const char* name;
  idle waits;
};
constexpr policy policies[] = {
    {"poll", idle::poll}, {"wake", idle::wake}, {"spin", idle::spin}, {"phase", idle::phase}};

enum class company : std::uint8_t { nobody, quiet, listening };
constexpr const char* companies[] = {"idle_no_peer", "idle_quiet_peer", "idle_listening_peer"};

// Over all rounds.
struct cost {
  double cpu_s = 0, sleeps = 0, seconds = 0;

  void add(const service_usage& before, rt::time_point begin) {
    const service_usage after = service_usage::read();
    cpu_s += after.cpu_s - before.cpu_s;
    sleeps += after.sleeps - before.sleeps;
    seconds += nanoseconds_since(begin) / 1e9;
  }
  void report(benchmark::State& state) const {
    for (auto _ : state) state.SetIterationTime(cpu_s / seconds); // of a second
    state.counters["cpu_percent"] = 100 * cpu_s / seconds;
    state.counters["wakeups_per_s"] = sleeps / seconds;
  }
};

struct loop_figures : cost {
  std::vector<double> publish_p50, publish_p99, p50, p99;
};

endpoint listen(idle waits) {
  auto robot =
      endpoint::listen(0, {.idle_policy = waits, .service_cpu = there, .service_priority = priority});
  if (!robot) give_up("cannot listen");
  return std::move(*robot);
}

publisher<odometry> advertise(endpoint& on) {
  auto odom = on.advertise<odometry>("/odom", {.period = period});
  if (!odom) give_up("cannot advertise");
  return std::move(*odom);
}

void stand_idle(idle waits, company with, cost& into) {
  endpoint robot = listen(waits);
  const publisher<odometry> odom = advertise(robot);
  std::optional<raw_client> client;
  if (with != company::nobody && !client.emplace(robot.port()).ok()) give_up("cannot connect");
  if (with == company::listening) {
    if (!client->send(raw_client::frame_of(wire::opcode::text, R"({"op":"subscribe","topic":"/odom"})")))
      give_up("cannot subscribe");
    while (!odom.wanted()) std::this_thread::yield();
  }
  std::this_thread::sleep_for(settling);
  const service_usage before = service_usage::read();
  const auto begin = monotonic_clock::now();
  std::this_thread::sleep_for(idle_time);
  into.add(before, begin);
}

void run_loop(idle waits, loop_figures& into) {
  endpoint robot = listen(waits);
  publisher<odometry> odom = advertise(robot);
  auto seen = robot.subscribe<json_text>("/odom");
  if (!seen) give_up("cannot subscribe");
  while (!odom.wanted()) std::this_thread::yield();
  std::vector<double> published, arrived;
  auto next = monotonic_clock::now();
  const auto turn = [&] {
    wait_until(next);
    next += period;
    const auto begin = monotonic_clock::now();
    if (!odom.publish({0.001, 1, 2, 3, 4}, begin)) give_up("refused to publish");
    published.push_back(nanoseconds_since(begin) / 1e3);
    while (!seen->try_take()) continue;
    arrived.push_back(nanoseconds_since(begin) / 1e3);
  };
  for (const auto end = next + settling; next < end;) turn();
  published.clear();
  arrived.clear();
  const service_usage before = service_usage::read();
  const auto begin = monotonic_clock::now();
  for (const auto end = next + loop_time; next < end;) turn();
  into.add(before, begin);
  into.publish_p50.push_back(quantile(published, 0.5));
  into.publish_p99.push_back(quantile(published, 0.99));
  into.p50.push_back(quantile(arrived, 0.5));
  into.p99.push_back(quantile(arrived, 0.99));
}

template <class Report>
void register_one(const std::string& measured, const policy& of, Report&& report) {
  benchmark::RegisterBenchmark((measured + "/" + of.name).c_str(), std::forward<Report>(report))
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  constexpr std::size_t kinds = std::size(companies);
  std::array<std::array<cost, kinds>, std::size(policies)> idles;
  std::array<loop_figures, std::size(policies)> loops;
  read_priority(count, arguments);
  return run_on_two_cores("bench_idle_policies", count, arguments, [&](int rounds) {
    take_priority();
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < std::size(policies); ++i) {
        for (std::size_t k = 0; k < kinds; ++k)
          stand_idle(policies[i].waits, static_cast<company>(k), idles[i][k]);
        run_loop(policies[i].waits, loops[i]);
      }
    }
    for (std::size_t k = 0; k < kinds; ++k) {
      for (std::size_t i = 0; i < std::size(policies); ++i)
        register_one(companies[k], policies[i],
                     [&of = idles[i][k]](benchmark::State& state) { of.report(state); });
    }
    for (std::size_t i = 0; i < std::size(policies); ++i) {
      register_one("loop_1khz", policies[i], [&of = loops[i]](benchmark::State& state) {
        of.report(state);
        state.counters["publish_p50_us"] = median(of.publish_p50);
        state.counters["publish_p99_us"] = median(of.publish_p99);
        state.counters["p50_us"] = median(of.p50);
        state.counters["p99_us"] = median(of.p99);
      });
    }
    return true;
  });
}
