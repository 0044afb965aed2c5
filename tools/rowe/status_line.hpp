// SPDX-License-Identifier: Apache-2.0
// A line on stderr that says where a program is: the next one takes its place, and so does whatever else is
// written to stderr (see output.hpp). For terminals only.
#pragma once
#include <cstddef>
#include <string_view>

namespace rowe::tools {

namespace status_line {

// Whether stderr is a terminal that can do it.
bool is_possible() noexcept;

// Shows a text, cut where the terminal ends. Main thread.
void show(std::string_view text);

// Takes it away. Any thread.
void clear() noexcept;

// What takes it away, where one is shown and `text` for stderr is to take its place; else empty. Any thread.
std::string_view taken_away() noexcept;

} // namespace status_line

// How wide the terminal is that stdout is; 0: it is none, or does not say.
std::size_t columns_of_stdout() noexcept;

} // namespace rowe::tools
