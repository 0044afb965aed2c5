// SPDX-License-Identifier: Apache-2.0
// Another program, run without a shell, and what it writes to its stdout.
#pragma once
#include <sys/types.h>

#include <span>
#include <string>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class child {
 public:
  // Begins `words[0]`, as PATH finds it. error() is an errno value, or 0 if it runs.
  explicit child(std::span<const char* const> words);
  child(const child&) = delete;
  child& operator=(const child&) = delete;
  ~child(); // ends it

  int error() const noexcept { return error_; }

  enum class outcome { line, end, too_late, too_much, interrupted };
  // The next line, without its end, on the main thread. `too_much`: there is no end of what it writes.
  outcome next(std::string& line, rt::time_point deadline);

  // How it ended: its exit code, or -1 for a signal. Waits for it.
  int end();

 private:
  int error_ = 0;
  ::pid_t process_ = -1;
  int output_ = -1;
  std::size_t bytes_ = 0;
  std::string read_; // beyond the last line
};

} // namespace rowe::tools
