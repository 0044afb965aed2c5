// SPDX-License-Identifier: Apache-2.0
#pragma once
// Every header includes this. A compiler without C++20 ends here with one error, and does not go on to
// hundreds.
#if __cplusplus < 202002L
#include <rowe needs C++20: compile with -std=c++20>
#endif
#include <cstddef>

// Marks a function that a real-time loop may call: it never allocates, locks or enters the kernel, never
// waits, and ends after a bounded number of steps. tests/rt_contract calls every function so marked, in every
// state it can be in, under traps for system calls, the heap, locks and page faults; its list must name each
// of them.
#define ROWE_RT

namespace rowe::rt {

// Shared words stand this far apart: two 64-byte lines, because x86 prefetches the neighbour of a line and
// some ARM cores have lines of 128 bytes.
inline constexpr std::size_t line_bytes = 128;

} // namespace rowe::rt
