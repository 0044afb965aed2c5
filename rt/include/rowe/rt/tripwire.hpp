// SPDX-License-Identifier: Apache-2.0
// Checks of the real-time contract while a program runs: in an armed scope of a thread, every call of the
// heap, every lock, every system call and every page fault is counted, or stops the program with the name of
// the call.
//
//   rowe::rt::tripwire::watch_system_calls();       // once in the real-time thread, after set-up
//   ...
//   auto wire = rowe::rt::tripwire::arm();
//   ring.try_push(x);
//   const auto seen = wire.disarm();                // seen.clean()
//
// For tests, benches and dev builds: link rowe::tripwire into the *executable*. It then defines malloc, free,
// pthread_mutex_lock and their relatives there, which pass on to the C library's own, so that the calls of
// every library in the process are seen. Needs glibc on x86-64 or arm64. Not together with AddressSanitizer
// or ThreadSanitizer, which define the same functions and make system calls themselves.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt::tripwire {

// What was seen in an armed scope.
struct report {
  std::uint64_t allocations =
      0;                   // calls of malloc, calloc, realloc, aligned_alloc, ..., and of free but free(NULL)
  std::uint64_t locks = 0; // pthread mutexes, rwlocks, spin locks, condition variables and semaphores
  std::uint64_t system_calls = 0; // of threads that called watch_system_calls(); 0 in others
  std::uint64_t wake_writes = 0;  // to the descriptor of expect_writes_to(); they are no violation
  std::uint64_t page_faults = 0;  // minor and major
  std::uint64_t waits = 0;        // voluntary context switches
  std::uint64_t preemptions = 0;  // involuntary ones; not the thread's fault, so they do not count in clean()
  long last_system_call = -1;     // its number; -1 when there was none
  const char* last_call = "";     // name of the last allocation or lock; "" when there was none

  // None of what the contract forbids.
  bool clean() const noexcept {
    return allocations == 0 && locks == 0 && system_calls == 0 && page_faults == 0 && waits == 0;
  }
  // "2 heap calls (last: free), 1 system call (last: write)", or "clean": written into `buffer` and cut
  // where it ends; returns the part written. Never allocates.
  std::string_view text(std::span<char> buffer) const noexcept;
};

// From here on, for the rest of its life, the system calls of the calling thread are counted while it is
// armed, and run as ever, only slower, because each is trapped (seccomp, SECCOMP_RET_TRAP) and then made for
// it. Such a thread can start no threads and no processes: that fails with EPERM. Sets no_new_privs for the
// thread and, once, a handler for SIGSYS; unblocks that signal. False where the kernel does not permit it;
// errno says why.
bool watch_system_calls() noexcept;
bool watches_system_calls() noexcept;

// From here on the calling thread may write to this descriptor, and to no other: such calls are counted
// apart. For rowe::idle::wake and endpoint::wake_descriptor(). -1: none.
void expect_writes_to(int descriptor) noexcept;

enum class on_violation : std::uint8_t {
  count,
  stop, // write "real-time contract broken in thread NAME: malloc" with a backtrace to stderr, and abort
};

// An armed scope of the calling thread; leaves it on destruction. Scopes do not nest.
class [[nodiscard]] scope {
 public:
  explicit scope(on_violation reaction) noexcept;
  scope(const scope&) = delete;
  scope& operator=(const scope&) = delete;
  ~scope();

  // Ends the scope and says what was seen in it; when called again, says the same again. In a scope that
  // stops, page faults are only seen here.
  report disarm() noexcept;

 private:
  bool armed_ = true;
  report before_;
  report seen_;
};

inline scope arm(on_violation reaction = on_violation::count) noexcept { return scope{reaction}; }

// Calls of the allocating functions in the whole process since it started. The difference of two results
// shows whether "0 allocations per message" holds in all threads. Any thread.
std::uint64_t process_allocations() noexcept;

} // namespace rowe::rt::tripwire
