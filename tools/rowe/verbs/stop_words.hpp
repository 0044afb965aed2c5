// SPDX-License-Identifier: Apache-2.0
// What `rowe stop` and `rowe reset` say about a stop, from the robot's answers. See docs/stop.md.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

// "412 µs", "4.2 ms", "100 ms", "1.2 s".
std::string time_words(rt::duration time);

// A member of an answer: as plain text, empty where it is null or missing; as an integer, which may be spelt
// as a string.
std::string text_member(std::string_view answer, std::string_view name);
std::optional<std::int64_t> integer_member(std::string_view answer, std::string_view name);

// "stopped by 10.0.0.7:4711 12 s ago, number 17", from the state that the robot tells.
std::string state_words(std::string_view state);

// The names of the loops that have not acknowledged the stop of that state: "base, arm"; and of the guards
// that are silent. Empty: none.
std::string late_loops(std::string_view state);
std::string silent_guards(std::string_view state);

} // namespace rowe::tools
