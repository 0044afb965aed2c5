// SPDX-License-Identifier: Apache-2.0
// What the threads of this process but the calling one use: of a bench that has one thread, the service
// thread of its endpoint.
#pragma once
#include <string_view>

#include <sys/resource.h>

#include <rowe/endpoint.hpp>

namespace rowe::bench {

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
