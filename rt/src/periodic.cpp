// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/periodic.hpp>

#include <ctime>

namespace rowe::rt {

void kernel_clock::sleep_until(time_point deadline) noexcept {
  constexpr std::int64_t second = 1'000'000'000;
  const std::int64_t ns = nanoseconds_of(deadline);
  const timespec until{.tv_sec = ns / second, .tv_nsec = ns % second};
  // An interrupted wait is the caller's to repeat: it looks first whether the signal was to end it.
  (void)::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

template class basic_periodic<kernel_clock>;

} // namespace rowe::rt
