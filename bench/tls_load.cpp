// SPDX-License-Identifier: Apache-2.0
// Question: does a robot with a thousand clients over wss, a tenth of them hostile, still stop in time?
//
// Measured, for one robot, of which all healthy clients are connected all the time:
//   quiet   they take what its loop publishes, and nobody else is there
//   loaded  the same; hostile clients do their worst, each again and again, a sixth of them each: read
//           nothing, begin handshakes, ask for new keys, send wrong records, leave without close_notify, show
//           wrong tokens; and --visits clients a second connect, upgrade and leave in good order
// The loop has 1 kHz: --fast of the clients take each value of it, the others --values a second. A probe
// calls /rowe/stop every 2 ms over wss (stop_probe.hpp), from the time it was to be sent. Rounds have both
// parts, in alternating order, with a pause between them in which the strangers leave.
//
// stop_*_us is how long a stop takes; `p99_of_quiet` the median over the rounds of the ratio of the p99s;
// loop_*_us how late the loop woke; cycle_*_us what the service thread ran in a cycle (cycle_cost.hpp);
// `handshakes_per_s` those that were done; `lost` the values that healthy clients never got, and `broken`
// how many of their connections ended, of the whole run: none. `unanswered` stops must be none.
//
// Robot: the service thread on core --here, SCHED_FIFO --prio where that is granted, idle::poll; the loop on
// core --there, with the priority less 10; the probe SCHED_FIFO 10 there. The clients are another process, on
// any core.
//
// Excluded: networks.
//
// What would make it lie: other load; a host that takes cores away; two cores for a thousand peers: what the
// clients take, neither the loop nor the probe has.
//
// Run: bench_tls_load [--rounds=5] [--seconds=5] [--clients=1000] [--fast=10] [--visits=100] [--values=5]
//      [--prio=80]
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <sched.h>

#include <benchmark/benchmark.h>

#include "cycle_cost.hpp"
#include "loaded_robot.hpp"
#include "stop_counters.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

int priority = 80;
int seconds = 5;

struct part {
  const char* name;
  stop_figures stops{};
  std::vector<double> cycles{};       // of all rounds
  std::vector<double> longest{};      // cycle, in each round
  std::vector<double> handshakes{};   // a second, in each round
  std::array<rt::duration, 3> late{}; // p50, p99, max of the loop; the last is of all rounds
};

// Threads that begin here may run on any of the two.
void run_anywhere() {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  for (const int each : {here, there}) CPU_SET(static_cast<unsigned>(each), &cpus);
  (void)::sched_setaffinity(0, sizeof cpus, &cpus); // refused: the bench still runs
}

// Of the whole run.
struct losses {
  std::uint64_t values = 0, connections = 0;
};

void report(part& of, const part& quiet, const losses& lost) {
  benchmark::RegisterBenchmark((std::string{"tls_load/"} + of.name).c_str(),
                               [&of, &quiet, &lost](benchmark::State& state) {
                                 for (auto _ : state)
                                   state.SetIterationTime(quantile(of.stops.trips, 0.5) * 1e-9);
                                 state.counters["stop_p50_us"] = quantile(of.stops.trips, 0.5) / 1000;
                                 state.counters["stop_p99_us"] = quantile(of.stops.trips, 0.99) / 1000;
                                 state.counters["stop_max_us"] = quantile(of.stops.trips, 1) / 1000;
                                 state.counters["unanswered"] =
                                     static_cast<double>(of.stops.asked - of.stops.answered);
                                 std::vector<double> each;
                                 for (std::size_t i = 0; i < of.stops.p99s.size(); ++i)
                                   each.push_back(of.stops.p99s[i] / quiet.stops.p99s[i]);
                                 state.counters["p99_of_quiet"] = median(std::move(each));
                                 state.counters["loop_p50_us"] = nanoseconds(of.late[0]) / 1000;
                                 state.counters["loop_p99_us"] = nanoseconds(of.late[1]) / 1000;
                                 state.counters["loop_max_us"] = nanoseconds(of.late[2]) / 1000;
                                 state.counters["cycle_p50_us"] = quantile(of.cycles, 0.5) / 1000;
                                 state.counters["cycle_p99.9_us"] = quantile(of.cycles, 0.999) / 1000;
                                 state.counters["cycle_max_us"] = median(of.longest) / 1000;
                                 state.counters["handshakes_per_s"] = median(of.handshakes);
                                 state.counters["lost"] = static_cast<double>(lost.values);
                                 state.counters["broken"] = static_cast<double>(lost.connections);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

class run {
 public:
  run(const load::plan& of, load::board& shown) : shown_{shown} {
    run_anywhere();
    endpoint_options options = load::options_for(of, files_);
    options.service_cpu = here;
    options.service_priority = priority;
    robot_ = open_robot(options);
    if (!robot_) return;
    loop_ = std::make_unique<load::loop>(
        *robot_, of,
        rt::thread_options{.name = "loop", .cpu = there, .priority = std::max(priority - 10, 0)});
    shown.port.set(robot_->port());
    healthy_ = load::eventually([&] { return shown.open.get() == of.healthy; }, 120s);
    probe_ = std::make_unique<load::stop_caller>(robot_->port());
    probe_->send({});
    healthy_ = healthy_ && probe_->hear(); // from here on it stands
  }
  bool ok() const { return healthy_ && probe_->ok(); }

  void measure(part& into, std::size_t number) {
    shown_.disturbed.set(number != 0);
    std::this_thread::sleep_for(1s);
    const double before = count_of(*robot_, "tls_handshakes");
    loop_->measure(number);
    begin_cycles();
    call_stops(*probe_, std::chrono::seconds{seconds}, into.stops);
    std::vector<double> cycles = cycles_taken();
    into.handshakes.push_back((count_of(*robot_, "tls_handshakes") - before) / seconds);
    into.longest.push_back(quantile(cycles, 1));
    into.cycles.insert(into.cycles.end(), cycles.begin(), cycles.end());
    const rt::histogram& late = loop_->lateness(number);
    into.late = {late.percentile(50), late.percentile(99), late.max()};
    shown_.disturbed.set(false);
    (void)load::eventually([&] { return shown_.strangers.get() == 0; }, 10s);
  }

 private:
  load::board& shown_;
  load::server_files files_;
  std::optional<endpoint> robot_;
  std::unique_ptr<load::loop> loop_;
  std::unique_ptr<load::stop_caller> probe_;
  bool healthy_ = false;
};

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  namespace load = rowe::load;
  const auto option = [&](const char* name, int otherwise) {
    return static_cast<std::uint32_t>(std::max(0, number_option(count, arguments, name, otherwise)));
  };
  seconds = number_option(count, arguments, "seconds", seconds);
  priority = number_option(count, arguments, "prio", priority);
  const std::uint32_t clients = option("clients", 1000);
  const load::plan plan{.healthy = clients - clients / 10,
                        .fast = option("fast", 10),
                        .hostile = clients / 10,
                        .visits_per_s = option("visits", 100),
                        .values_per_s = std::max(1U, option("values", 5))};
  load::board* const shown = load::make_board();
  if (shown == nullptr) return 1;
  const load::fleet clients_of_it{plan, *shown}; // before there is a thread
  load::raise_descriptor_limit();
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own sockets
  std::array<part, 2> parts{{{"quiet"}, {"loaded"}}};
  losses lost;
  return run_on_two_cores("bench_tls_load", count, arguments, [&](int rounds) {
    run one{plan, *shown};
    if (!one.ok()) {
      std::fprintf(stderr, "the robot did not open, or not all of its clients came: %u\n", shown->open.get());
      return false;
    }
    for (int round = 0; round < rounds; ++round) {
      for (const std::size_t first : {0U, 1U}) {
        const std::size_t which = round % 2 == 0 ? first : 1 - first;
        one.measure(parts[which], which);
      }
    }
    lost = {shown->lost.get() + shown->wrong.get(), shown->broken.get()};
    if (parts[0].cycles.empty()) {
      std::fprintf(stderr, "no cycle was measured: the program is linked wrongly\n");
      return false;
    }
    for (part& of : parts) report(of, parts[0], lost);
    return true;
  });
}
