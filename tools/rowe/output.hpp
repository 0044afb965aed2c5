// SPDX-License-Identifier: Apache-2.0
// The one place where programs write: to their standard streams and to files that they are told to make.
// Every write and close is checked. stdout that cannot be written (a full disk) is told on stderr, with how
// much was, and makes of a program that ends well one that failed. A pipe that its reader has closed is no
// error: `head` has what it wanted.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "arguments/command_line.hpp"

namespace rowe::tools {

// Writes it all, however many calls that takes, and waits where `to` does not. How many bytes were written:
// fewer where a signal came that ends the program (see interrupt.hpp), or else for the reason in errno.
std::size_t write_all(int to, std::string_view text) noexcept;

// Makes the file, or writes it anew. The reason when that fails, and otherwise 0.
int write_file(const std::string& path, std::string_view text) noexcept;

// Writes `text` to stdout at once; main thread. False when there is no use in going on: nobody reads any
// more, it cannot be written, or a signal came meanwhile. What is to be said of that is said by this.
bool emit(std::string_view text);

// Whether stdout could not be written, for another reason than that nobody reads it.
bool output_failed() noexcept;

// Writes to stderr, on any thread, in place of a status line (see status_line.hpp). run_program() finds out
// whether that failed.
void write_to_stderr(std::string_view text) noexcept;

// While the whole screen is drawn, what is written to stderr is kept, and written when it is no longer. Main
// thread.
void hold_stderr(bool held);

// What main() does: watches for signals, runs the program with the arguments behind its name, closes its
// streams, and says how it ended.
int run_program(int count, char** words, exit_code (*program)(argument_list));

} // namespace rowe::tools
