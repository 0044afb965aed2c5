// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>

#include <rowe/rt/clock.hpp>

namespace rowe::tests {

// A clock that moves only when told to. One thread.
class fake_clock {
 public:
  rt::time_point now() const noexcept { return now_; }
  void advance(rt::duration by) noexcept { now_ += by; }
  void set(rt::time_point to) noexcept { now_ = to; }
  // What a periodic loop calls to wait: a fake clock is there at once.
  void sleep_until(rt::time_point deadline) noexcept {
    if (deadline > now_) now_ = deadline;
  }

 private:
  rt::time_point now_{std::chrono::seconds{1000}};
};

} // namespace rowe::tests
