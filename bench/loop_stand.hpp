// SPDX-License-Identifier: Apache-2.0
// What benches of one loop beside one service thread stand on: priorities, a loop that is on time, and what
// the service thread uses.
#pragma once
#include <string_view>

#include <sys/resource.h>

#include <rowe/endpoint.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/thread.hpp>
#include <rowe/schema.hpp>

#include "rounds.hpp"

namespace rowe::bench {
// What the loops publish.
struct odometry {
  double stamp, x, y, heading, speed;
};
} // namespace rowe::bench
template <>
inline constexpr auto rowe::schema<rowe::bench::odometry> =
    rowe::fields<&rowe::bench::odometry::stamp, &rowe::bench::odometry::x, &rowe::bench::odometry::y,
                 &rowe::bench::odometry::heading, &rowe::bench::odometry::speed>{};

namespace rowe::bench {

inline int priority = 50; // SCHED_FIFO, of both threads, where that is permitted; 0: ordinary ones

// Takes `--priority=N`. Before run_on_two_cores().
inline void read_priority(int& count, char** arguments) {
  priority = number_option(count, arguments, "priority", priority);
}
// For the calling thread, which run_on_two_cores() has put on its core. Refused: the bench still runs.
inline void take_priority() {
  if (priority > 0) (void)rt::prepare_this_thread({.name = "bench", .priority = priority});
}

// Asleep for the most part, but awake in time.
inline void wait_until(rt::time_point when) {
  rt::kernel_clock::sleep_until(when - std::chrono::microseconds{300});
  while (rt::monotonic_clock::now() < when) continue;
}

// What the threads of this process but the calling one use: the service thread.
struct service_usage {
  double cpu_s = 0;
  double sleeps = 0; // how often it gave its core up by itself, which is how often it wakes

  static service_usage read() {
    const service_usage all = of(RUSAGE_SELF), here = of(RUSAGE_THREAD);
    return {all.cpu_s - here.cpu_s, all.sleeps - here.sleeps};
  }

 private:
  static service_usage of(int whom) {
    rusage used{};
    (void)::getrusage(whom, &used); // cannot fail
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) / 1e6;
    };
    return {seconds(used.ru_utime) + seconds(used.ru_stime), static_cast<double>(used.ru_nvcsw)};
  }
};

inline double count_of(const endpoint& of, std::string_view name) {
  for (const auto& one : of.counts())
    if (one.name == name) return static_cast<double>(one.value);
  return 0;
}

} // namespace rowe::bench
