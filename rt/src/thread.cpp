// SPDX-License-Identifier: Apache-2.0
// Starting and preparing threads. All of it is set-up: system calls, and glibc's own allocations.
#include <rowe/rt/thread.hpp>

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <mutex>

#include "diagnostic.hpp"

namespace rowe::rt {
namespace {

struct memory_range {
  char* begin = nullptr;
  std::size_t bytes = 0;
};

std::size_t page_bytes() noexcept { return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)); }

grant granted_or(int error) noexcept { return {.asked = true, .error = error}; }
grant granted_if_zero(int result) noexcept { return granted_or(result == 0 ? 0 : errno); }

grant set_name(std::string_view name) noexcept {
  char text[16]; // what the kernel keeps, with its terminating zero
  const std::size_t length = std::min(name.size(), sizeof text - 1);
  std::memcpy(text, name.data(), length);
  text[length] = '\0';
  return granted_or(::pthread_setname_np(::pthread_self(), text));
}

grant pin(int cpu) noexcept {
  if (cpu < 0 || cpu >= CPU_SETSIZE) return granted_or(EINVAL);
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(static_cast<std::size_t>(cpu), &only);
  return granted_or(::pthread_setaffinity_np(::pthread_self(), sizeof only, &only));
}

// SCHED_RESET_ON_FORK: a thread or process that this one starts with the standard means is an ordinary one,
// instead of competing with it at its own priority.
grant set_fifo(int priority) noexcept {
  const sched_param parameters{.sched_priority = priority};
  return granted_if_zero(::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters));
}

void set_ordinary() noexcept {
  const sched_param parameters{.sched_priority = 0};
  (void)::sched_setscheduler(0, SCHED_OTHER, &parameters); // giving up a priority is always permitted
}

// Writes to every page of the next `bytes` of the stack.
[[gnu::noinline]] void touch_stack(std::size_t bytes, std::size_t page) noexcept {
  auto* const buffer = static_cast<volatile char*>(__builtin_alloca(bytes));
  for (std::size_t at = 0; at < bytes; at += page) buffer[at] = 0;
}

// Touches at most `bytes_max` of the stack below the caller's frame; returns what was touched, in whole
// pages.
memory_range prefault_stack(std::size_t bytes_max) noexcept {
  pthread_attr_t attributes;
  if (::pthread_getattr_np(::pthread_self(), &attributes) != 0) return {};
  void* lowest = nullptr;
  std::size_t size = 0;
  ::pthread_attr_getstack(&attributes, &lowest, &size);
  ::pthread_attr_destroy(&attributes);

  const std::size_t page = page_bytes();
  auto* const here = static_cast<char*>(__builtin_frame_address(0));
  const auto left = static_cast<std::size_t>(here - static_cast<char*>(lowest));
  if (left < 2 * page) return {};
  // The last page above the guard is left to touch_stack's own frame.
  const std::size_t bytes = std::min(bytes_max, left - page) / page * page;
  touch_stack(bytes, page);
  char* const touched = here - bytes;
  char* const begin = touched + (page - reinterpret_cast<std::uintptr_t>(touched) % page) % page;
  return {begin, static_cast<std::size_t>(here - begin)};
}

long limit_of(__rlimit_resource what) noexcept {
  rlimit limit{};
  if (::getrlimit(what, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return -1;
  return static_cast<long>(std::min<rlim_t>(limit.rlim_cur, LONG_MAX));
}

grants prepare(const thread_options& options, memory_range& locked) noexcept {
  grants given;
  given.cpu = options.cpu.value_or(-1);
  given.priority = options.priority;
  given.priority_limit = limit_of(RLIMIT_RTPRIO);
  given.locked_bytes_limit = limit_of(RLIMIT_MEMLOCK);
  if (!options.name.empty()) given.named = set_name(options.name);
  if (options.cpu) given.pinned = pin(*options.cpu);
  const memory_range stack = prefault_stack(options.stack_bytes);
  given.stack_locked = granted_if_zero(::mlock(stack.begin, stack.bytes));
  if (given.stack_locked) locked = stack;
  given.slack = granted_if_zero(::prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul));
  if (options.priority != 0) given.fifo = set_fifo(options.priority);
  return given;
}

// Everything but the signals that a fault raises in the thread itself.
sigset_t blockable_signals() noexcept {
  sigset_t signals;
  ::sigfillset(&signals);
  for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS}) ::sigdelset(&signals, fault);
  return signals;
}

} // namespace

std::string_view grants::text(std::span<char> buffer) const noexcept {
  detail::diagnostic s{buffer};
  if (pinned) s.say("pinned to cpu ").say(cpu);
  if (fifo) s.next(", ").say("SCHED_FIFO ").say(priority);
  if (!pinned.asked && !fifo.asked) s.say("ordinary scheduling");
  if (pinned.error == EINVAL) {
    s.next("; ").say("cpu ").say(cpu).say(
        " does not exist or is not allowed to this process: see `taskset -p`");
  } else if (pinned.refused()) {
    s.next("; ").say("not pinned to cpu ").say(cpu).say(" (errno ").say(pinned.error).say(")");
  }
  if (fifo.error == EINVAL) {
    s.next("; ").say("SCHED_FIFO has no priority ").say(priority).say(": 1 to 99");
  } else if (fifo.refused()) {
    s.next("; ").say("SCHED_FIFO ").say(priority).say(" not permitted (rtprio limit ").say(priority_limit);
    s.say("): raise `ulimit -r` or run as root");
  }
  if (stack_locked.refused()) {
    s.next("; ").say("stack not locked (memlock limit ").say(locked_bytes_limit);
    s.say(" bytes): raise `ulimit -l`");
  }
  if (named.refused()) s.next("; ").say("name not set (errno ").say(named.error).say(")");
  if (slack.refused()) s.next("; ").say("timer slack not set (errno ").say(slack.error).say(")");
  return s.view();
}

grants prepare_this_thread(const thread_options& options) noexcept {
  memory_range locked;
  return prepare(options, locked);
}

bool this_thread_is_real_time() noexcept {
  const int policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return policy == SCHED_FIFO || policy == SCHED_RR || policy == SCHED_DEADLINE;
}

grant lock_process_memory() noexcept { return granted_if_zero(::mlockall(MCL_CURRENT | MCL_FUTURE)); }

// What the starting thread and the started one share until prepared() was called.
struct thread::start_block {
  thread_options options;
  body entry;
  void* function;
  rt::grants given = {};
  std::mutex mutex = {};
  std::condition_variable changed = {};
  bool prepared = false;
};

void thread::start(const thread_options& options, body entry, void* function) noexcept {
  start_block block{.options = options, .entry = entry, .function = function};
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  const std::size_t page = page_bytes();
  const auto least = static_cast<std::size_t>(::sysconf(_SC_THREAD_STACK_MIN));
  const std::size_t stack_bytes = (std::max(options.stack_bytes, least) + page - 1) / page * page;
  error_ = ::pthread_attr_setstacksize(&attributes, stack_bytes);
  if (error_ == 0) {
    // Blocked here already, so that there is no moment in which the new thread could take a signal.
    const sigset_t blocked = blockable_signals();
    sigset_t before;
    ::pthread_sigmask(SIG_BLOCK, &blocked, &before);
    error_ = ::pthread_create(&handle_, &attributes, enter, &block);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }
  ::pthread_attr_destroy(&attributes);
  if (error_ != 0) return;
  joinable_ = true;
  std::unique_lock lock{block.mutex};
  block.changed.wait(lock, [&] { return block.prepared; });
  grants_ = block.given;
}

void* thread::enter(void* shared) noexcept {
  auto& block = *static_cast<start_block*>(shared);
  if (block.options.priority == 0) set_ordinary(); // the starting thread may have been a SCHED_FIFO one
  thread_options options = block.options;
  options.stack_bytes = SIZE_MAX; // all of it
  memory_range locked;
  block.given = prepare(options, locked);
  block.entry(block.function, block); // calls prepared(); `block` is gone afterwards
  // glibc keeps the stacks of finished threads for later ones, and would keep this one locked.
  if (locked.bytes != 0) ::munlock(locked.begin, locked.bytes);
  return nullptr;
}

grants thread::prepared(start_block& block) noexcept {
  const rt::grants given = block.given;
  // Set under the lock: once it is free again, the starting thread may return, and the block is gone.
  const std::lock_guard lock{block.mutex};
  block.prepared = true;
  block.changed.notify_one();
  return given;
}

void thread::join() noexcept {
  if (!joinable_) return;
  ::pthread_join(handle_, nullptr);
  joinable_ = false;
}

} // namespace rowe::rt
