// SPDX-License-Identifier: Apache-2.0
// Runs a scenario again and again, each time in a child process in which another call fails, and says what
// must not happen there: a crash, an abort, an exception, a hang, a descriptor left open, or what the
// scenario itself calls wrong.
#pragma once
#include <cstdint>
#include <functional>
#include <string_view>

#include "failures/injection.hpp"

namespace failures {

// In the child.
class trial {
 public:
  trial(kind which, std::uint64_t n) noexcept : which_{which}, n_{n} {}

  // From here on a call may fail, until end().
  void begin() noexcept { arm(which_, n_); }
  void end() noexcept;
  // Whether one has failed since begin().
  bool failed() const noexcept;
  // Whether it was one of libraries_that_do_not_recover, after which nothing can be said.
  bool unrecoverable() const noexcept;

  // Notes what is wrong, if something is; the first such thing is reported. False if something is wrong.
  bool expect(bool right, std::string_view what) noexcept;

  std::uint64_t calls() const noexcept { return calls_; }

 private:
  kind which_;
  std::uint64_t n_;
  std::uint64_t calls_ = 0;
};

using scenario = std::function<void(trial&)>;

// A gtest failure for each call whose failure is not handled. By default some calls, evenly chosen; with
// ROWE_FAILURES=all in the environment every one, until a run comes to its end without meeting it; with
// ROWE_FAILURES=22 the 22nd. Returns how many calls a run makes in which nothing fails.
std::uint64_t fail_each(kind which, const scenario& run);

} // namespace failures
