// SPDX-License-Identifier: Apache-2.0
// What a real-time thread asks of the machine, and what it was granted. A machine that does not permit part
// of it gives the rest: what was not granted is reported with the reason and the remedy, and the caller
// decides whether that is enough.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

struct thread_options {
  std::string_view name = {};  // as `ps -L` and debuggers show it; the kernel keeps 15 bytes of it
  std::optional<int> cpu = {}; // nothing: wherever the starting thread may run
  int priority = 0;            // 1 to 99: SCHED_FIFO with it; 0: an ordinary thread
  std::size_t stack_bytes =
      256 * 1024; // touched and locked but for the last page; at least PTHREAD_STACK_MIN
};

// What became of one request.
struct grant {
  bool asked = false;
  int error = 0; // errno of the refusal; 0 when granted or not asked

  constexpr explicit operator bool() const noexcept { return asked && error == 0; } // asked and granted
  constexpr bool refused() const noexcept { return error != 0; }
};

struct grants {
  grant named = {};
  grant pinned = {};       // to `cpu`
  grant fifo = {};         // SCHED_FIFO with `priority`
  grant slack = {};        // timers of an ordinary thread fire at their time, not up to 50 us later
  grant stack_locked = {}; // touched in any case
  int cpu = -1;
  int priority = 0;
  long priority_limit = 0; // RLIMIT_RTPRIO and RLIMIT_MEMLOCK as they were, for the diagnostic; -1: unlimited
  long locked_bytes_limit = 0;

  // Nothing that was asked for was refused.
  constexpr bool complete() const noexcept {
    return !named.refused() && !pinned.refused() && !fifo.refused() && !slack.refused() &&
           !stack_locked.refused();
  }
  // A buffer of so many bytes holds the longest text().
  static constexpr std::size_t text_bytes_max = 400;
  // "pinned to cpu 2, SCHED_FIFO 80" or "SCHED_FIFO 80 not permitted (rtprio limit 0): raise `ulimit -r` or
  // run as root": written into `buffer` and cut where it ends; returns the part written. Any thread, never
  // allocates.
  std::string_view text(std::span<char> buffer) const noexcept;
};

// Applies the options to the calling thread, for a loop that runs on main or on another library's thread.
// Differs from rt::thread in this: no signal is blocked, because one of them may be what ends the loop;
// priority 0 leaves the scheduling as it is (`chrt` may have set it); and of the stack that is left, at most
// `stack_bytes` are touched and locked. Set-up: makes system calls, may allocate.
grants prepare_this_thread(const thread_options& options) noexcept;

// Whether the calling thread has a real-time priority (SCHED_FIFO, SCHED_RR or SCHED_DEADLINE), whoever gave
// it. A system call.
bool this_thread_is_real_time() noexcept;

// mlockall(MCL_CURRENT | MCL_FUTURE), for programs that own their process. The library never calls it: it
// locks its own memory only. From here on every page that the process maps counts against `ulimit -l`.
grant lock_process_memory() noexcept;

} // namespace rowe::rt
