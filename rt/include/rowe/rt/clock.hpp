// SPDX-License-Identifier: Apache-2.0
// Time: one monotonic clock, nanoseconds, as a type that cannot be mixed up with a duration. Everything that
// depends on time takes `now` as an argument or a clock as a template parameter, so that tests and the
// simulation pass a fake one.
#pragma once
#include <chrono>
#include <cstdint>
#include <ctime>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

using duration = std::chrono::nanoseconds;

// CLOCK_MONOTONIC. Reading it is a vDSO call (no system call) where the kernel's clock source is tsc or
// arch_sys_counter; `rowe::rt::clock_is_cheap()` measures that at set-up.
struct monotonic_clock {
  using duration = rt::duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<monotonic_clock>;
  static constexpr bool is_steady = true;

  // Any thread. Never waits, never allocates.
  ROWE_RT static time_point now() noexcept {
    timespec t;
    ::clock_gettime(CLOCK_MONOTONIC, &t);
    return time_point{std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec}};
  }
};

using time_point = monotonic_clock::time_point;

inline constexpr time_point never = (time_point::max)(); // later than everything
inline constexpr duration for_ever = (duration::max)();

// `now + wait`, but never past `never`: a wait that is not finite has no end. A negative wait is for ever
// too.
ROWE_RT constexpr time_point deadline_after(time_point now, duration wait) noexcept {
  if (wait < duration::zero() || wait >= never - now) return never;
  return now + wait;
}

// Nanoseconds since the clock's origin; times on the wire and in shared words are written so.
ROWE_RT constexpr std::int64_t nanoseconds_of(time_point t) noexcept { return t.time_since_epoch().count(); }

// What a reading of the clock costs on this machine.
struct clock_cost {
  duration read{};        // one monotonic_clock::now()
  duration system_call{}; // the same asked of the kernel directly, for comparison
  char source[32]{};      // the kernel's clock source: "tsc", "hpet", ...; "" when it cannot be read
  bool cheap = false;     // the source is tsc or arch_sys_counter, and a reading is no system call

  // A reading is no vDSO call: it costs at least what the system call does, and one that stays outside the
  // kernel costs a fraction of it. Between them stands three quarters, because system calls are quick on some
  // machines.
  bool enters_kernel() const noexcept { return read * 4 >= system_call * 3; }
  explicit operator bool() const noexcept { return cheap; }
};

// Measures it; takes about a millisecond. Set-up: makes system calls, reads /sys.
clock_cost clock_is_cheap() noexcept;

} // namespace rowe::rt
