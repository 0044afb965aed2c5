// SPDX-License-Identifier: Apache-2.0
// Ctrl-C, SIGTERM and SIGHUP end a verb in an orderly way: they set a flag, cut a sleep short, and the verb's
// own loop sees it. A second one ends the program as the system would. A signal that is ignored when we start
// (nohup) stays so.
#pragma once
#include <rowe/rt/clock.hpp>

namespace rowe::tools::interrupt {

// How late a signal may be seen that arrives in the instant between asking and falling asleep.
inline constexpr rt::duration slice = std::chrono::milliseconds{100};

// From here on. SIGPIPE and SIGXFSZ are ignored as well: writing to a pipe that was closed, or beyond the
// size that a file may have, is an error value (see output.hpp).
// Call it on the main thread before there are others.
void watch() noexcept;

// Whether one of the signals came.
bool seen() noexcept;

// What is done at once when the first of them comes, on whichever thread: only what a handler of signals may
// do. Null: nothing.
void at_first_signal(void (*action)() noexcept) noexcept;

// Waits until then, or until a signal comes. On the main thread.
void sleep_until(rt::time_point deadline) noexcept;

} // namespace rowe::tools::interrupt
