// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/clock.hpp>

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace rowe::rt {
namespace {

// The median over batches, each long against the clock's steps, so that a preempted one does not count.
template <class Read>
duration cost_of(Read read) noexcept {
  constexpr int reads = 400;
  std::array<duration, 11> batches;
  for (duration& batch : batches) {
    const time_point begin = monotonic_clock::now();
    for (int i = 0; i < reads; ++i) read();
    batch = (monotonic_clock::now() - begin) / reads;
  }
  std::nth_element(batches.begin(), batches.begin() + batches.size() / 2, batches.end());
  return batches[batches.size() / 2];
}

void read_clock_source(char (&source)[32]) noexcept {
  const int file =
      ::open("/sys/devices/system/clocksource/clocksource0/current_clocksource", O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  const ssize_t bytes = ::read(file, source, sizeof source - 1);
  ::close(file);
  const auto end = static_cast<std::size_t>(std::max<ssize_t>(bytes, 0));
  *std::find(source, source + end, '\n') = '\0';
}

} // namespace

clock_cost clock_is_cheap() noexcept {
  clock_cost cost;
  read_clock_source(cost.source);
  cost.read = cost_of([] { (void)monotonic_clock::now(); });
  cost.system_call = cost_of([] {
    timespec t;
    ::syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &t);
  });
  const std::string_view source{cost.source};
  cost.cheap = (source == "tsc" || source == "arch_sys_counter") && !cost.enters_kernel();
  return cost;
}

} // namespace rowe::rt
