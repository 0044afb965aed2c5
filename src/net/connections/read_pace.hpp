// SPDX-License-Identifier: Apache-2.0
// How many bytes are read of a connection at once while no other has anything to read. A stop that arrives
// meanwhile waits until they are handled, so the bound is a time, `turn_time`. A large read costs fewer
// system calls, and fewer acknowledgments of TCP, than many small ones.
//
// It begins with the least amount. A turn that follows a large read is measured. After one that took less
// than half of the time the amount doubles; after one that took too long it shrinks in the same proportion.
// Where the last read was small, the next one has the least amount: what it brings was not measured.
//
// Pure: the time is passed in. Service thread.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>

#include <rowe/rt/clock.hpp>

namespace rowe::net {

class read_pace {
 public:
  static constexpr rt::duration turn_time = std::chrono::microseconds{50};

  constexpr read_pace(std::size_t bytes_min, std::size_t bytes_max) noexcept
      : bytes_min_{bytes_min}, bytes_max_{bytes_max}, bytes_{bytes_min} {}

  // How much the next read may take.
  std::size_t bytes() const noexcept { return measures_ ? bytes_ : bytes_min_; }
  // Whether the next turn is to be measured: the last one was a large read.
  bool measures() const noexcept { return measures_; }

  // A turn has read so much, and its sink has handled it. `took` counts only if measures() was true when the
  // turn began. Not for turns that read nothing.
  void note(std::size_t bytes, rt::duration took) noexcept {
    const bool measured = measures_;
    measures_ = bytes >= bytes_min_;
    if (!measured || !measures_) return;
    if (took > turn_time) {
      const auto share = static_cast<std::size_t>(turn_time.count());
      bytes_ = std::max(bytes * share / static_cast<std::size_t>(took.count()), bytes_min_);
    } else if (bytes >= bytes_ && 2 * took <= turn_time) {
      bytes_ = std::min(2 * bytes_, bytes_max_);
    }
  }

 private:
  std::size_t bytes_min_;
  std::size_t bytes_max_;
  std::size_t bytes_;
  bool measures_ = false;
};

} // namespace rowe::net
