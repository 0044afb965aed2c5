// SPDX-License-Identifier: Apache-2.0
// Threads for real-time work: named, pinned, with a priority, their stack touched and locked, no signal ever
// delivered to them.
#pragma once
#include <pthread.h>

#include <concepts>
#include <utility>

#include <rowe/rt/grants.hpp>

namespace rowe::rt {

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

 private:
  struct start_block; // lives on the starting thread's stack until the new one says that it needs it no more
  using body = void (*)(void* function, start_block& block);

  template <class Function>
  static void run(void* function, start_block& block) {
    Function mine{std::move(*static_cast<Function*>(function))};
    const rt::grants given = prepared(block);
    if constexpr (std::invocable<Function, const rt::grants&>) {
      mine(given);
    } else {
      mine();
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
