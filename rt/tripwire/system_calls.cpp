// SPDX-License-Identifier: Apache-2.0
// System calls of one thread, seen by the kernel itself: a seccomp filter, loaded in that thread only, traps
// every call but those that come from one instruction of ours, the gate. A trapped call arrives as SIGSYS in
// the thread that made it; the handler records its number, makes the call through the gate and puts the
// result where the caller expects it. So a call is seen whoever makes it, the C library's inline ones and the
// vDSO's fall-backs too, and the program goes on as if nothing had been: faking a failure instead would crash
// malloc.
//
// A filter stays for the rest of a thread's life; armed or not is decided in the handler.
#include "state.hpp"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <iterator>

#if defined(__x86_64__)
asm(R"(
  .pushsection .text
  .globl rowe_tripwire_gate, rowe_tripwire_gate_end
  .hidden rowe_tripwire_gate, rowe_tripwire_gate_end
  .type rowe_tripwire_gate, @function
rowe_tripwire_gate:
  .cfi_startproc
  mov %rdi, %rax
  mov %rsi, %rdi
  mov %rdx, %rsi
  mov %rcx, %rdx
  mov %r8, %r10
  mov %r9, %r8
  mov 8(%rsp), %r9
  syscall
rowe_tripwire_gate_end:
  ret
  .cfi_endproc
  .size rowe_tripwire_gate, . - rowe_tripwire_gate
  .popsection
)");
#elif defined(__aarch64__)
asm(R"(
  .pushsection .text
  .globl rowe_tripwire_gate, rowe_tripwire_gate_end
  .hidden rowe_tripwire_gate, rowe_tripwire_gate_end
  .type rowe_tripwire_gate, %function
rowe_tripwire_gate:
  .cfi_startproc
  mov x8, x0
  mov x0, x1
  mov x1, x2
  mov x2, x3
  mov x3, x4
  mov x4, x5
  mov x5, x6
  svc 0
rowe_tripwire_gate_end:
  ret
  .cfi_endproc
  .size rowe_tripwire_gate, . - rowe_tripwire_gate
  .popsection
)");
#else
#error "the tripwire knows x86-64 and arm64"
#endif

namespace rowe::rt::tripwire {
namespace {

// The registers of a trapped call, of which the kernel has put back all as they were, and where its caller
// expects the result.
struct arguments {
  long word[6];
};

#if defined(__x86_64__)
constexpr std::uint32_t this_architecture = AUDIT_ARCH_X86_64;

arguments arguments_of(const ucontext_t& thread) noexcept {
  const auto& r = thread.uc_mcontext.gregs;
  return {{r[REG_RDI], r[REG_RSI], r[REG_RDX], r[REG_R10], r[REG_R8], r[REG_R9]}};
}
void set_result(ucontext_t& thread, long result) noexcept { thread.uc_mcontext.gregs[REG_RAX] = result; }
#else
constexpr std::uint32_t this_architecture = AUDIT_ARCH_AARCH64;

arguments arguments_of(const ucontext_t& thread) noexcept {
  const auto r = [&](int i) { return static_cast<long>(thread.uc_mcontext.regs[i]); };
  return {{r(0), r(1), r(2), r(3), r(4), r(5)}};
}
void set_result(ucontext_t& thread, long result) noexcept {
  thread.uc_mcontext.regs[0] = static_cast<unsigned long>(result);
}
#endif

constexpr std::size_t kernel_mask_bytes = 8;

// A child would run on in the handler with half a context, and a program that exec starts would inherit the
// filter without having the gate.
bool starts_something(long number) noexcept {
  constexpr long starters[] = {
#if defined(SYS_fork)
    SYS_fork,
    SYS_vfork,
#endif
    SYS_clone,
    SYS_clone3,
    SYS_execve,
    SYS_execveat
  };
  return std::find(std::begin(starters), std::end(starters), number) != std::end(starters);
}

long make_for(long number, ucontext_t& thread) noexcept {
  const auto [a] = arguments_of(thread);
  if (starts_something(number)) return -EPERM;
  const long result = rowe_tripwire_gate(number, a[0], a[1], a[2], a[3], a[4], a[5]);
  // Returning from the handler brings back the signal mask and the alternate stack of before. Where the call
  // changed them, that must be the new ones; and SIGSYS stays unblocked, since a call that is trapped while
  // it is blocked kills the process. (The C library blocks everything for a moment when a thread ends.)
  if (number == SYS_rt_sigprocmask) {
    (void)system_call_past_the_filter(SYS_rt_sigprocmask, SIG_BLOCK, nullptr, &thread.uc_sigmask,
                                      kernel_mask_bytes);
    ::sigdelset(&thread.uc_sigmask, SIGSYS);
  } else if (number == SYS_sigaltstack) {
    (void)system_call_past_the_filter(SYS_sigaltstack, nullptr, &thread.uc_stack);
  }
  return result;
}

void on_trap(int, siginfo_t* info, void* context) noexcept {
  constexpr int from_seccomp = 1;      // SYS_SECCOMP, which glibc's headers do not name
  if (info->si_code != from_seccomp) { // someone sent the signal: do what it does by itself
    (void)std::signal(SIGSYS, SIG_DFL);
    (void)std::raise(SIGSYS);
    return;
  }
  auto& thread = *static_cast<ucontext_t*>(context);
  const long number = info->si_syscall;
  const bool wakes =
      number == SYS_write && here.expected >= 0 && arguments_of(thread).word[0] == here.expected;
  if (here.armed && wakes) {
    ++here.seen.wake_writes;
  } else if (here.armed) {
    here.seen.last_system_call = number;
    if (here.reaction == on_violation::stop) stop_program(nullptr);
    ++here.seen.system_calls;
  }
  set_result(thread, make_for(number, thread));
}

bool load_filter() noexcept {
  const auto gate = reinterpret_cast<std::uint64_t>(rowe_tripwire_gate_end);
  const auto low = static_cast<std::uint32_t>(gate);
  const auto high = static_cast<std::uint32_t>(gate >> 32);
  constexpr std::uint32_t pointer = offsetof(seccomp_data, instruction_pointer); // little-endian on both
  // clang-format off
  sock_filter program[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, this_architecture, 0, 8),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, pointer),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, low, 0, 2),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, pointer + 4),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, high, 5, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_rt_sigreturn, 3, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 2, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  // clang-format on
  const sock_fprog filter{.len = std::size(program), .filter = program};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1ul, 0ul, 0ul, 0ul) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0ul, 0ul) == 0;
}

} // namespace

bool watch_system_calls() noexcept {
  if (here.filtered) return true;
  struct sigaction action {};
  action.sa_sigaction = on_trap;
  action.sa_flags = SA_SIGINFO | SA_NODEFER; // another signal's handler may be trapped inside ours
  if (::sigaction(SIGSYS, &action, nullptr) != 0) return false;
  sigset_t ours;
  ::sigemptyset(&ours);
  ::sigaddset(&ours, SIGSYS);
  ::pthread_sigmask(SIG_UNBLOCK, &ours, nullptr);
  here.filtered = load_filter();
  return here.filtered;
}

bool watches_system_calls() noexcept { return here.filtered; }

void expect_writes_to(int descriptor) noexcept { here.expected = descriptor; }

// clang-format off
#define ROWE_SYSTEM_CALLS(X)                                                                                 \
  X(read) X(write) X(readv) X(writev) X(openat) X(close) X(lseek) X(ioctl) X(fcntl) X(dup) X(dup3)           \
  X(pipe2) X(socket) X(connect) X(accept4) X(sendto) X(recvfrom) X(sendmsg) X(recvmsg) X(shutdown)           \
  X(setsockopt) X(ppoll) X(pselect6) X(epoll_pwait) X(epoll_ctl) X(eventfd2) X(timerfd_settime) X(mmap)      \
  X(munmap) X(mremap) X(mprotect) X(madvise) X(brk) X(mlock) X(munlock) X(mlockall) X(membarrier) X(futex)   \
  X(clock_nanosleep) X(nanosleep) X(clock_gettime) X(gettimeofday) X(sched_yield) X(getcpu) X(getrusage)     \
  X(getpid) X(gettid) X(tgkill) X(kill) X(rt_sigprocmask) X(rt_sigaction) X(sigaltstack) X(prctl)            \
  X(getrandom) X(clone) X(clone3) X(execve) X(sched_setaffinity) X(sched_setscheduler)                       \
  X(sched_getaffinity) X(uname) X(newfstatat)
// clang-format on

const char* system_call_name(long number) noexcept {
  switch (number) {
#define ROWE_NAME_OF(name)                                                                                   \
  case SYS_##name: return #name;
    ROWE_SYSTEM_CALLS(ROWE_NAME_OF)
#undef ROWE_NAME_OF
#if defined(SYS_poll)
  case SYS_poll: return "poll";
  case SYS_open: return "open";
  case SYS_epoll_wait: return "epoll_wait";
#endif
  default: return "";
  }
}

} // namespace rowe::rt::tripwire
