// SPDX-License-Identifier: Apache-2.0
// Question: how long does a stop take, over wss, while strangers make the robot do TLS handshakes?
//
// Measured, as in bench_stop_under_flood, by a probe that calls /rowe/stop every 2 ms over a connection under
// TLS 1.3, while
//   quiet       nothing else comes
//   handshakes  full ones, --rate a second, open-loop: connect, X25519 and the check of the certificate; then
//               the client resets the connection
//   upgrades    as many, each of which becomes a WebSocket connection before it is reset
//   mute        as `handshakes`, and 250 clients which have sent half of their first message, and no more
//   elsewhere   as `handshakes`, with another endpoint of this process: what the machine does to the robot
//               while as much goes on, and what is left is not the robot's
// in two settings:
//   real_time   the service thread alone on core --here, SCHED_FIFO --prio where that is granted, idle::spin
//   shipped     no core, no priority, idle::poll
// The thread of the handshakes runs where the kernel likes, as in every program. Clients and probe share core
// --there; the probe is SCHED_FIFO 10 there.
//
// `p99_of_quiet` is the median over the rounds of the ratio of the p99s of a round, `cycle_of_quiet` that of
// the longest cycles of the service thread, and `cycle_p50_us` the median of those; `cycle_before_p50_us` of
// those until the strangers came, in which the probe connects and the robot stops, and `cycle_grew` the ratio
// to them. `cycle_ran_p50_us` is the median of what the thread itself ran in its longest cycle
// (cycle_cost.hpp), `cycle_ran_of_quiet` the median of its ratio to the quiet one, `cycle_ran_p99.9_us` of
// all cycles. `handshakes_per_s` is how many came to their end. The other counters are those of
// bench_stop_under_flood.
//
// Excluded: what a loop adds to the answer; networks; what becomes of the handshakes themselves.
//
// What would make it lie: other load; a host that takes cores away (see the witness); that the clients are in
// the robot's process, and so share its memory map and its heap.
//
// Run: bench_stop_under_handshakes [--rounds=5] [--seconds=2] [--prio=80] [--rate=100]
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/socket.h>

#include <benchmark/benchmark.h>

#include <rowe/rowe.hpp>

#include "cycle_cost.hpp"
#include "stop_counters.hpp"
#include "tls_client.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t mute_clients = 250;

int priority = 80;
int seconds = 2;
int rate = 100;

enum class strangers { none, shake, upgrade, shake_beside_mute, shake_elsewhere };
enum class setting { real_time, shipped };

struct contender {
  std::string name;
  setting robot;
  strangers beside;
  stop_figures seen{};
  std::vector<double> shaken_per_s{}; // in each round
  std::vector<double> before{};       // the longest cycle until the strangers came, in each round
  std::vector<double> ran{};          // what the thread itself ran in its longest cycle, in each round
  std::vector<double> ran_all{};      // the same in each cycle, of all rounds
};

class probe_client {
 public:
  probe_client(std::uint16_t port, SSL_CTX* with) : connection_{port, with} {
    ok_ = connection_.ok() && connection_.shake() && connection_.ask_for_upgrade(port) &&
          connection_.take_answer();
  }
  bool ok() const { return ok_; }
  void send(const std::string& bytes) { ok_ = ok_ && connection_.send(bytes); }
  // One frame of the server's.
  bool hear() {
    std::array<char, 65536> buffer;
    if (!take(buffer.data(), 2)) return false;
    std::size_t length = static_cast<unsigned char>(buffer[1]);
    if (length == 126) {
      if (!take(buffer.data(), 2)) return false;
      length =
          std::size_t{static_cast<unsigned char>(buffer[0])} << 8 | static_cast<unsigned char>(buffer[1]);
    }
    return take(buffer.data(), length);
  }

 private:
  bool take(char* into, std::size_t bytes) { return ok_ = ok_ && connection_.take(std::span{into, bytes}); }

  tls_client connection_;
  bool ok_ = false;
};

// Handshakes at their times, until told to stop. How many came to their end.
std::uint64_t shake_at_rate(std::uint16_t port, SSL_CTX* with, bool upgrade, const std::atomic<bool>& stop) {
  const rt::duration period = rt::duration{1s} / rate;
  std::uint64_t shaken = 0;
  rt::time_point due = monotonic_clock::now();
  while (!stop.load(std::memory_order_relaxed)) { // relaxed: only when, not what
    std::this_thread::sleep_until(std::chrono::steady_clock::time_point{due.time_since_epoch()});
    due += period;
    tls_client one{port, with};
    bool good = one.ok() && one.shake();
    if (upgrade) good = good && one.ask_for_upgrade(port) && one.take_answer();
    if (good) ++shaken;
    const linger at_once{1, 0};
    (void)::setsockopt(one.fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once); // else it ends in order
  }
  return shaken;
}

// The beginning of a client's first message, of which the rest never comes.
std::vector<std::unique_ptr<tls_client>> open_mute(std::uint16_t port) {
  std::vector<std::unique_ptr<tls_client>> all;
  while (all.size() < mute_clients) {
    all.push_back(std::make_unique<tls_client>(port, nullptr));
    all.back()->send(std::string{"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11});
  }
  return all;
}

// Threads that begin here may run on any core, or on one.
void run_on(std::optional<int> cpu) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  for (const int each : {here, there})
    if (!cpu || each == *cpu) CPU_SET(static_cast<unsigned>(each), &cpus);
  (void)::sched_setaffinity(0, sizeof cpus, &cpus); // refused: the bench still runs
}

endpoint_options options_of(setting robot, const server_files& files) {
  endpoint_options options;
  options.tls = files.options();
  options.page = false;
  options.limits.handshakes_max = mute_clients + 50;
  options.limits.messages_per_second_max = 0;
  options.stop.unguarded = true;
  if (robot == setting::shipped) return options;
  options.idle_policy = idle::spin;
  options.service_cpu = here;
  options.service_priority = priority;
  return options;
}

bool measure(contender& of, const server_files& files) {
  of.seen.gaps.push_back(witness(here, of.robot == setting::real_time ? priority : 0));
  run_on(std::nullopt);
  auto opened = open_robot(options_of(of.robot, files));
  std::optional<endpoint> other;
  if (of.beside == strangers::shake_elsewhere) other = open_robot(options_of(setting::shipped, files));
  run_on(there);
  if (!opened || (of.beside == strangers::shake_elsewhere && !other)) return false;
  endpoint robot = std::move(*opened);
  const ssl_context with = client_context(TLS1_3_VERSION);
  probe_client probe{robot.port(), with.get()};
  if (!probe.ok()) return false;
  const auto latch = make_stand(robot, probe);

  of.before.push_back(count_of(robot, "cycle_ns_max"));
  std::vector<std::unique_ptr<tls_client>> mute;
  if (of.beside == strangers::shake_beside_mute) mute = open_mute(robot.port());
  std::atomic<bool> stop{false};
  std::uint64_t shaken = 0;
  rt::thread storm;
  if (of.beside != strangers::none) {
    storm = on_the_other_core(
        [&] { shaken = shake_at_rate(robot.port(), with.get(), of.beside == strangers::upgrade, stop); });
  }
  begin_cycles();
  call_stops(probe, std::chrono::seconds{seconds}, of.seen);
  std::vector<double> ran = cycles_taken();
  of.ran.push_back(quantile(ran, 1));
  of.ran_all.insert(of.ran_all.end(), ran.begin(), ran.end());
  stop.store(true, std::memory_order_relaxed); // see shake_at_rate()
  if (of.beside != strangers::none) storm.join();
  of.seen.cycles.push_back(count_of(robot, "cycle_ns_max"));
  of.shaken_per_s.push_back(static_cast<double>(shaken) / seconds);
  return true;
}

std::vector<contender> contenders() {
  std::vector<contender> all;
  for (const setting robot : {setting::real_time, setting::shipped}) {
    const std::string in = robot == setting::real_time ? "/real_time" : "/shipped";
    all.push_back({"quiet" + in, robot, strangers::none});
    all.push_back({"handshakes" + in, robot, strangers::shake});
    all.push_back({"upgrades" + in, robot, strangers::upgrade});
    all.push_back({"mute" + in, robot, strangers::shake_beside_mute});
    all.push_back({"elsewhere" + in, robot, strangers::shake_elsewhere});
  }
  return all;
}

double median_ratio(const std::vector<double>& of, const std::vector<double>& to) {
  std::vector<double> each;
  for (std::size_t i = 0; i < of.size(); ++i) each.push_back(of[i] / to[i]);
  return median(std::move(each));
}

void report(contender& of, const contender& quiet) {
  benchmark::RegisterBenchmark(("stop_under_handshakes/" + of.name).c_str(),
                               [&of, &quiet](benchmark::State& state) {
                                 add_stop_counters(of.seen, state);
                                 state.counters["p99_of_quiet"] = median_ratio(of.seen.p99s, quiet.seen.p99s);
                                 state.counters["cycle_of_quiet"] =
                                     median_ratio(of.seen.cycles, quiet.seen.cycles);
                                 state.counters["cycle_p50_us"] = median(of.seen.cycles) / 1000;
                                 state.counters["cycle_ran_p50_us"] = median(of.ran) / 1000;
                                 state.counters["cycle_ran_p99.9_us"] = quantile(of.ran_all, 0.999) / 1000;
                                 state.counters["cycle_ran_of_quiet"] = median_ratio(of.ran, quiet.ran);
                                 state.counters["cycle_before_p50_us"] = median(of.before) / 1000;
                                 state.counters["cycle_grew"] = median_ratio(of.seen.cycles, of.before);
                                 state.counters["handshakes_per_s"] = median(of.shaken_per_s);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own socket BIO
  seconds = number_option(count, arguments, "seconds", seconds);
  priority = number_option(count, arguments, "prio", priority);
  rate = number_option(count, arguments, "rate", rate);
  const server_files files;
  std::vector<contender> all = contenders();
  return run_on_two_cores("bench_stop_under_handshakes", count, arguments, [&](int rounds) {
    run_on(there);
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        contender& one = all[round % 2 == 0 ? i : all.size() - 1 - i];
        if (measure(one, files)) continue;
        std::fprintf(stderr, "%s: the robot did not open, or the probe did not connect\n", one.name.c_str());
        return false;
      }
    }
    const contender* quiet = nullptr;
    for (contender& one : all) {
      if (one.beside == strangers::none) quiet = &one;
      report(one, *quiet);
    }
    return true;
  });
}
