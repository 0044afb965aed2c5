// SPDX-License-Identifier: Apache-2.0
// How much of the processor a cycle of the service thread takes, for benches. The program is linked so that
// core::cycle() is called through here. A clock that counts only what the thread itself runs is read before
// and after, which costs 0.5 us: what the machine does to the thread meanwhile does not count, but for what
// other programs do to its caches, and for interrupts.
#pragma once
#include <cstdint>
#include <vector>

namespace rowe::bench {

// Forgets what was measured.
void begin_cycles();
// Nanoseconds of each cycle since then; of the first 2^20 of them. Empty: the program was linked wrongly.
std::vector<double> cycles_taken();

} // namespace rowe::bench
