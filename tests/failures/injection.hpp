// SPDX-License-Identifier: Apache-2.0
// Failures on demand: the n-th call of a kind fails, counted over all threads of the process since it was
// armed. The calls are those that this executable defines in front of the C library
// (heap.cpp, system_calls.cpp), so that every library in the process makes them here; and libwebsockets'
// allocator (libwebsockets.cpp).
//
// The thread that armed is the test's own and fails only inside `in_the_library`; all others are the
// library's.
#pragma once
#include <atomic>
#include <cstdint>

namespace failures {

enum class kind : std::uint8_t { none, heap, system_calls, libwebsockets };

// From now on call number `n` fails, once; n is 1 or more. With a number that is never reached it counts
// only.
void arm(kind which, std::uint64_t n) noexcept;
// Ends it. How many calls there were.
std::uint64_t disarm() noexcept;
// The call that failed, for a parent to look into.
struct failure {
  std::atomic<const char*> call;   // its name, "malloc"; nullptr when none has failed
  std::atomic<const char*> within; // whose call it was, where that is one of libraries_that_do_not_recover
};
void keep_failure_in(failure& place) noexcept;

// What does not recover from a failed allocation, and cannot be made to from outside: the beginning of the
// name of a library's file or of a function.
//
// simdjson 3.0.1 terminates: its first use in a process chooses a kernel and allocates that one's name.
// glibc 2.36 crashes, or finds no name for the rest of the process and forgets a descriptor: its first
// look-up reads nsswitch.conf.
inline constexpr const char* libraries_that_do_not_recover[] = {"libsimdjson.so", "getaddrinfo"};

// The connection to this local port of the peer is left alone: failures of others must not concern it.
void spare_connection_of(std::uint16_t peer_port) noexcept;

struct in_the_library {
  in_the_library() noexcept;
  ~in_the_library();
  in_the_library(const in_the_library&) = delete;
  in_the_library& operator=(const in_the_library&) = delete;
};

// ---- for the functions that fail

// Whether this is the call that fails.
bool fails(kind which, const char* call) noexcept;
bool spared(int descriptor) noexcept;
// Lets libwebsockets allocate by a function that can fail.
void watch_libwebsockets() noexcept;

} // namespace failures
