// SPDX-License-Identifier: Apache-2.0
// Takes back commands that a loop has in its window already (docs/drive.md).
//
// Each command has the number of the turn in which it was accepted. When its sender drives no more, or the
// robot is stopped, the service thread begins the next turn. A loop acts on a command only while its turn
// lasts. So no new command is needed to end an old one, and a window that is not read keeps nothing alive.
#pragma once
#include <cstdint>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::detail {

// Written by the service thread, read by one loop. Nobody waits.
template <class Atomics = rt::std_atomics>
class command_turn {
 public:
  // The service thread's. From now on the turn of this number lasts, and no other. Afterwards it grants the
  // permit of a reset, or writes a command of this turn.
  void set(std::int64_t turn) noexcept {
    // relaxed: a loop that acts has seen that permit, or that command; their releases and acquires
    // (stop_permit.hpp, window.hpp) order this store before its load in is()
    number_.store(turn, std::memory_order_relaxed);
  }
  std::int64_t number() const noexcept {
    return number_.load(std::memory_order_relaxed); // relaxed: its own
  }

  // The loop's, after it has looked at the permit and read the command: whether the turn of this number
  // lasts.
  ROWE_RT bool is(std::int64_t turn) const noexcept {
    return number_.load(std::memory_order_relaxed) == turn; // relaxed: see set()
  }

  // Set-up: before it is shared.
  void reset() noexcept {
    number_.store(0, std::memory_order_relaxed); // relaxed: the submission of the queue pair publishes it
  }

 private:
  typename Atomics::template variable<std::int64_t> number_{0};
};

} // namespace rowe::detail
