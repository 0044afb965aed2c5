// SPDX-License-Identifier: Apache-2.0
// What the parts of the tripwire share: the state of each thread, and the one way to the kernel that the
// filter leaves open.
#pragma once
#include <cstdint>
#include <type_traits>

#include <rowe/rt/tripwire.hpp>

namespace rowe::rt::tripwire {

// One a thread. The TLS model is the one that needs no call into the loader, which might allocate, and the
// state no constructor: malloc itself looks at it, from the first moment of the process on.
struct thread_state {
  bool armed = false;
  bool filtered = false;
  int expected = -1; // writes to it are expected
  on_violation reaction = on_violation::count;
  report seen = {};
};
extern constinit thread_local thread_state here [[gnu::tls_model("initial-exec")]];

// Writes what was called, in which thread and from where to stderr, and aborts.
[[noreturn]] void stop_program(const char* call) noexcept;

// "write" for SYS_write; "" for the rarer ones.
const char* system_call_name(long number) noexcept;

inline void saw_allocation(const char* call) noexcept {
  if (!here.armed) [[likely]]
    return;
  if (here.reaction == on_violation::stop) stop_program(call);
  ++here.seen.allocations;
  here.seen.last_call = call;
}

inline void saw_lock(const char* call) noexcept {
  if (!here.armed) [[likely]]
    return;
  if (here.reaction == on_violation::stop) stop_program(call);
  ++here.seen.locks;
  here.seen.last_call = call;
}

} // namespace rowe::rt::tripwire

// Makes a system call that no filter of ours traps: the filter knows the address behind the instruction,
// which is rowe_tripwire_gate_end. Returns what the kernel returns: a result, or -errno.
extern "C" long rowe_tripwire_gate(long number, long a, long b, long c, long d, long e, long f);
extern "C" const char rowe_tripwire_gate_end[];

namespace rowe::rt::tripwire {

template <class Number>
requires std::is_integral_v<Number> || std::is_enum_v<Number>
long word_of(Number number) noexcept { return static_cast<long>(number); }
inline long word_of(const void* address) noexcept {
  return static_cast<long>(reinterpret_cast<std::intptr_t>(address));
}

template <class... Arguments>
requires(sizeof...(Arguments) <= 6) long system_call_past_the_filter(long number,
                                                                     Arguments... arguments) noexcept {
  const long all[6] = {word_of(arguments)...};
  return rowe_tripwire_gate(number, all[0], all[1], all[2], all[3], all[4], all[5]);
}

} // namespace rowe::rt::tripwire
