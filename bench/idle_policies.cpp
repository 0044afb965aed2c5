// SPDX-License-Identifier: Apache-2.0
// Question: what does each idle policy of the service thread cost, and what does it bring?
//
// Measured, for each policy: a loop publishes a struct every millisecond and looks without pause until its
// own subscription has it as text, so a value goes into a lane, through the service thread's encoder, and
// back through another lane.
//   publish  the call publish(value, now) alone: under `wake` with its write to the eventfd
//   arrives  from the beginning of that call until try_take() has the value
//   cpu      what all threads but the loop's use of a core: the service thread
//   turns    cycles of the service thread a second, each of which asks the kernel once for events
// then the same without publishing, with somebody who listens and with nobody. The loop is pinned to core 0
// and the service thread to core 1; both are SCHED_FIFO (50, 40) where that is permitted.
//
// Excluded: sockets; a peer's share is the same under all policies.
//
// What would make it lie: other load on either core, where FIFO is not permitted; a machine that halts its
// cores (a virtual one above all), where waking costs ten times what it does where a core sleeps lightly; a
// machine with one core.
//
// Run: bench_idle_policies [SECONDS for each line, 3]
#include <rowe/rowe.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/thread.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <thread>
#include <vector>

struct bench_pose {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<bench_pose> =
    rowe::fields<&bench_pose::stamp, &bench_pose::x, &bench_pose::y, &bench_pose::heading,
                 &bench_pose::speed>{};

namespace {

using namespace std::chrono_literals;
using rowe::rt::monotonic_clock;

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) / 1e6;
}
double used_by(int whom) {
  rusage u{};
  ::getrusage(whom, &u);
  return seconds_of(u.ru_utime) + seconds_of(u.ru_stime);
}

std::uint64_t count_of(const rowe::endpoint& of, std::string_view name) {
  for (const auto& one : of.counts()) {
    if (one.name == name) return one.value;
  }
  return 0;
}

double quantile(std::vector<double>& of, double q) {
  if (of.empty()) return 0;
  std::sort(of.begin(), of.end());
  return of[std::min(of.size() - 1, static_cast<std::size_t>(q * static_cast<double>(of.size())))];
}

double microseconds(rowe::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

// What the threads but the calling one use from here on.
class meter {
 public:
  explicit meter(const rowe::endpoint& of) : of_{of}, turns_{count_of(of, "cycles")} {}
  double seconds() const { return std::chrono::duration<double>(monotonic_clock::now() - begin_).count(); }
  double cpu_percent() const { return 100 * (others() - others_) / seconds(); }
  double turns() const { return static_cast<double>(count_of(of_, "cycles") - turns_) / seconds(); }

 private:
  static double others() { return used_by(RUSAGE_SELF) - used_by(RUSAGE_THREAD); }
  const rowe::endpoint& of_;
  rowe::time_point begin_ = monotonic_clock::now();
  double others_ = others();
  std::uint64_t turns_;
};

void measure(const char* name, rowe::idle policy, rowe::duration length) {
  auto robot =
      rowe::endpoint::listen(0, {.idle_policy = policy, .service_cpu = 1, .service_priority = 40}).value();
  auto odom = robot.advertise<bench_pose>("/odom").value();
  std::this_thread::sleep_for(100ms);
  const meter alone{robot};
  std::this_thread::sleep_for(length);
  std::printf("%-5s nobody listens                                             cpu %5.1f %%  turns %7.0f/s\n",
              name, alone.cpu_percent(), alone.turns());

  auto seen = robot.subscribe<rowe::json_text>("/odom").value();
  while (!odom.wanted()) std::this_thread::yield();
  const meter listened{robot};
  std::this_thread::sleep_for(length);
  std::printf("%-5s nothing is published                                       cpu %5.1f %%  turns %7.0f/s\n",
              name, listened.cpu_percent(), listened.turns());

  std::vector<double> published, arrived;
  const meter working{robot};
  rowe::rt::periodic loop{1ms};
  while (working.seconds() < std::chrono::duration<double>(length).count()) {
    const auto now = loop.wait();
    if (!now) break;
    const auto begin = monotonic_clock::now();
    if (!odom.publish({0.001, 1, 2, 3, 4}, begin)) continue;
    const auto handed = monotonic_clock::now();
    while (!seen.try_take()) continue;
    arrived.push_back(microseconds(monotonic_clock::now() - begin));
    published.push_back(microseconds(handed - begin));
  }
  const double cpu = working.cpu_percent();
  const double turns = working.turns();
  std::printf("%-5s 1 kHz  publish p50 %5.2f p99 %6.2f us  arrives p50 %6.1f p99 %6.1f us  cpu %5.1f %%  "
              "turns %7.0f/s\n",
              name, quantile(published, 0.5), quantile(published, 0.99), quantile(arrived, 0.5),
              quantile(arrived, 0.99), cpu, turns);
}

} // namespace

int main(int count, char** arguments) {
  const auto length = std::chrono::seconds{count > 1 ? std::max(1, std::atoi(arguments[1])) : 3};
  const rowe::rt::thread loop{{.name = "loop", .cpu = 0, .priority = 50},
                              [&](const rowe::rt::grants& granted) {
                                std::printf("SCHED_FIFO: %s\n", granted.fifo ? "yes" : "not permitted");
                                measure("poll", rowe::idle::poll, length);
                                measure("wake", rowe::idle::wake, length);
                                measure("spin", rowe::idle::spin, length);
                              }};
}
