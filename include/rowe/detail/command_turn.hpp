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
  // The service thread's. From now on the turn of this number lasts, and no other.
  void set(std::int64_t turn) noexcept {
    // release: pairs with the acquire in is(). A loop that has seen what this thread did afterwards, such as
    // the permit of a reset or a command of this turn, sees that the turns before are over.
    if (turn != number()) number_.store(turn, std::memory_order_release);
  }
  std::int64_t number() const noexcept {
    return number_.load(std::memory_order_relaxed); // relaxed: its own
  }

  // The loop's: whether the turn of this number lasts.
  ROWE_RT bool is(std::int64_t turn) const noexcept {
    return number_.load(std::memory_order_acquire) == turn; // acquire: pairs with the release in end()
  }

  // Set-up: before it is shared.
  void reset() noexcept {
    number_.store(0, std::memory_order_relaxed); // relaxed: the submission of the queue pair publishes it
  }

 private:
  typename Atomics::template variable<std::int64_t> number_{0};
};

} // namespace rowe::detail
