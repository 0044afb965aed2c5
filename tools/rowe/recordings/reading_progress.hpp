// SPDX-License-Identifier: Apache-2.0
// How far a file was read: a line on a terminal, once that takes longer than a second.
#pragma once
#include <cmath>
#include <string>

#include <rowe/rt/clock.hpp>

#include "../console.hpp"
#include "../interrupt.hpp"
#include "../status_line.hpp"

namespace rowe::tools {

class reading_progress {
 public:
  reading_progress(const std::string& path, bool quiet)
      : path_{path}, shown_{!quiet && status_line::is_possible()} {}
  ~reading_progress() { status_line::clear(); }
  reading_progress(const reading_progress&) = delete;
  reading_progress& operator=(const reading_progress&) = delete;

  // `part` is from 0 to 1. False: a signal came.
  bool operator()(double part) {
    const auto now = rt::monotonic_clock::now();
    if (shown_ && now >= next_) {
      next_ = now + std::chrono::milliseconds{200};
      status_line::show(joined(printable(path_), ": ", std::lround(part * 100), " %"));
    }
    return !interrupt::seen();
  }

 private:
  const std::string& path_;
  bool shown_;
  rt::time_point next_ = rt::monotonic_clock::now() + std::chrono::seconds{1};
};

} // namespace rowe::tools
