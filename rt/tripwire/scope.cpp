// SPDX-License-Identifier: Apache-2.0
// The armed scope, its report, and the end of a program that broke the contract.
#include "state.hpp"

#include "../src/diagnostic.hpp"

#include <execinfo.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cassert>
#include <cstdlib>

namespace rowe::rt::tripwire {

constinit thread_local thread_state here [[gnu::tls_model("initial-exec")]];

namespace {

// What the kernel counts for the calling thread.
report kernel_counts() noexcept {
  rusage used{};
  (void)system_call_past_the_filter(SYS_getrusage, RUSAGE_THREAD, &used);
  report counts;
  counts.page_faults = static_cast<std::uint64_t>(used.ru_minflt + used.ru_majflt);
  counts.waits = static_cast<std::uint64_t>(used.ru_nvcsw);
  counts.preemptions = static_cast<std::uint64_t>(used.ru_nivcsw);
  return counts;
}

void say_count(detail::diagnostic& s, std::uint64_t count, std::string_view what,
               std::string_view last) noexcept {
  if (count == 0) return;
  s.next(", ").say(static_cast<long>(count)).say(" ").say(what).say(count == 1 ? "" : "s");
  if (!last.empty()) s.say(" (last: ").say(last).say(")");
}

// The first backtrace() loads a library and allocates: not to be left to the moment of a breach, in which the
// heap may be locked. Once a process; twice does no harm.
void make_backtrace_ready() noexcept {
  static constinit std::atomic<bool> ready{false};
  // relaxed: pairs with the store below; only the flag counts
  if (ready.load(std::memory_order_relaxed)) return;
  void* frame[1];
  (void)::backtrace(frame, 1);
  ready.store(true, std::memory_order_relaxed); // relaxed: pairs with the load above
}

} // namespace

std::string_view report::text(std::span<char> buffer) const noexcept {
  detail::diagnostic s{buffer};
  if (clean()) return s.say("clean").view();
  say_count(s, allocations, "heap call", locks == 0 ? last_call : "");
  say_count(s, locks, "lock", last_call);
  say_count(s, system_calls, "system call", system_call_name(last_system_call));
  say_count(s, page_faults, "page fault", "");
  say_count(s, waits, "wait", "");
  return s.view();
}

void stop_program(const char* call) noexcept {
  here.armed = false;
  char name[17]{};
  (void)system_call_past_the_filter(SYS_prctl, PR_GET_NAME, name);
  char text[200];
  detail::diagnostic s{text};
  s.say("real-time contract broken in thread ").say(name).say(": ");
  if (call != nullptr) {
    s.say(call);
  } else {
    s.say("system call ").say(here.seen.last_system_call);
    s.say(" ").say(system_call_name(here.seen.last_system_call));
  }
  s.say("\n");
  (void)system_call_past_the_filter(SYS_write, STDERR_FILENO, s.view().data(), s.view().size());
  void* frames[64];
  ::backtrace_symbols_fd(frames, ::backtrace(frames, 64), STDERR_FILENO);
  std::abort();
}

scope::scope(on_violation reaction) noexcept {
  assert(!here.armed);
  if (reaction == on_violation::stop) make_backtrace_ready();
  here.reaction = reaction;
  here.seen = report{};
  before_ = kernel_counts();
  here.armed = true;
}

report scope::disarm() noexcept {
  if (!armed_) return seen_;
  armed_ = false;
  here.armed = false;
  seen_ = here.seen;
  const report after = kernel_counts();
  seen_.page_faults = after.page_faults - before_.page_faults;
  seen_.waits = after.waits - before_.waits;
  seen_.preemptions = after.preemptions - before_.preemptions;
  if (here.reaction == on_violation::stop && seen_.page_faults != 0) stop_program("page fault");
  return seen_;
}

scope::~scope() { (void)disarm(); }

} // namespace rowe::rt::tripwire
