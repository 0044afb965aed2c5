// SPDX-License-Identifier: Apache-2.0
// Threads for real-time work: named, pinned, with a priority, their stack touched and locked, no signal ever
// delivered to them. A machine that does not permit part of that gives the rest: what was granted is
// reported, with the reason and the remedy for what was not, and the caller decides whether that is enough.
#pragma once
#include <cerrno>
#include <concepts>
#include <cstddef>
#include <functional>
#include <optional>
#include <pthread.h>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

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
  long priority_limit = 0; // RLIMIT_RTPRIO and RLIMIT_MEMLOCK as they were, for the sentence; -1: unlimited
  long locked_bytes_limit = 0;

  // Nothing that was asked for was refused.
  constexpr bool complete() const noexcept {
    return !named.refused() && !pinned.refused() && !fifo.refused() && !slack.refused() &&
           !stack_locked.refused();
  }
  // "pinned to cpu 2, SCHED_FIFO 80" or "SCHED_FIFO not permitted (rtprio limit 0): raise `ulimit -r` or run
  // as root": written into `buffer` and cut where it ends; returns the part written. Any thread, never
  // allocates.
  std::string_view text(std::span<char> buffer) const noexcept;
};

// Applies the options to the calling thread, for a loop that runs on main or on another library's thread.
// Differs from rt::thread in this: no signal is blocked, because one of them may be what ends the loop;
// priority 0 leaves the scheduling as it is (`chrt` may have set it); and of the stack that is left, at most
// `stack_bytes` are touched and locked. Set-up: makes system calls, may allocate.
grants prepare_this_thread(const thread_options& options) noexcept;

// mlockall(MCL_CURRENT | MCL_FUTURE), for programs that own their process. The library never calls it: it
// locks its own memory only. From here on every page that the process maps counts against `ulimit -l`.
grant lock_process_memory() noexcept;

// A thread that runs one function and is joined on destruction. All signals are blocked in it but those that
// a fault in it raises (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS): a blocked fault would kill the
// process without its handler. A fork() anywhere in the process makes each page of its stack fault once more.
class thread {
 public:
  thread() noexcept = default;
  // Starts `function()`, or `function(const grants&)` where it wants to know. Returns when the thread has
  // prepared itself and is about to call it, so that grants() is final. When no thread can be started,
  // error() says why and the function is destroyed without having run. `function` is moved twice and must not
  // throw out of its call.
  template <class Function>
  requires std::invocable<Function> || std::invocable<Function, const rt::grants&>
  thread(const thread_options& options, Function function)
  noexcept { start(options, run<Function>, &function); }
  thread(thread&& other) noexcept
      : handle_{other.handle_},
        joinable_{std::exchange(other.joinable_, false)},
        error_{other.error_},
        grants_{other.grants_} {}
  thread& operator=(thread&& other) noexcept {
    if (this == &other) return *this;
    join();
    handle_ = other.handle_;
    joinable_ = std::exchange(other.joinable_, false);
    error_ = other.error_;
    grants_ = other.grants_;
    return *this;
  }
  ~thread() { join(); }

  // Waits until the function has returned; at once when there is no thread. Not from the thread itself.
  void join() noexcept;
  // A thread was started and has not been joined.
  bool joinable() const noexcept { return joinable_; }
  // errno of the start: 0, or why there is no thread (EAGAIN: a limit on threads or memory).
  int error() const noexcept { return error_; }
  const rt::grants& grants() const noexcept { return grants_; }
  // For pthread_* calls; only while joinable().
  pthread_t native_handle() const noexcept { return handle_; }

 private:
  struct start_block; // lives on the starting thread's stack until the new one says that it needs it no more
  using body = void (*)(void* function, start_block& block);

  template <class Function>
  static void run(void* function, start_block& block) {
    Function mine{std::move(*static_cast<Function*>(function))};
    const rt::grants given = prepared(block);
    if constexpr (std::invocable<Function, const rt::grants&>) {
      std::invoke(mine, given);
    } else {
      std::invoke(mine);
    }
  }
  static void* enter(void* block) noexcept;
  static rt::grants prepared(start_block& block) noexcept; // `block` is gone afterwards
  void start(const thread_options& options, body entry, void* function) noexcept;

  pthread_t handle_{};
  bool joinable_ = false;
  int error_ = 0;
  rt::grants grants_;
};

} // namespace rowe::rt
