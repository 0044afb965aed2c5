// SPDX-License-Identifier: Apache-2.0
// Takes what threads of this process submit: messages, requests and replies, a stated budget in a cycle. What
// finds no room is parked, so that it does not hold up other threads. Service thread only; nothing waits or
// allocates. A user thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>
#include <span>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/incoming/receiver.hpp"
#include "service/requests/call_router.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct thread_submissions_needs {
  core_state& state_;
  receiver& receiver_;
  direct_messages& direct_messages_;
  call_completion& call_completion_;
  call_router& call_router_;
};

class thread_submissions : thread_submissions_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint32_t>(bounds.door_slots);
  }
  thread_submissions(rt::arena& memory, const thread_submissions_needs& parts) noexcept
      : thread_submissions_needs{parts}, parked_{memory.carve<std::uint32_t>(state_.bounds().door_slots)} {}

  void take() noexcept;
  // Tries parked submissions again, as if they came now.
  void retry() noexcept;
  // At the end of a cycle: tells threads that wait for room that there may be some. `at_peers`: a peer has
  // new room. Returns whether there is new room anywhere.
  bool notify_room(bool at_peers) noexcept {
    const bool came = std::exchange(room_came_, false) || at_peers;
    if (came) state_.submissions.notify_room();
    return came;
  }

  bool more_left() const noexcept { return more_left_; } // the next cycle is needed at once
  bool waits() const noexcept { return parked_count_ != 0; }
  bool drained() const noexcept { return state_.submissions.drained(); }

 private:
  bool take_slot(std::uint32_t slot, bool parked) noexcept;

  std::span<std::uint32_t> parked_; // slots, in their order
  std::uint32_t parked_count_ = 0;
  std::uint64_t expired_ = 0; // there, and counted
  bool room_came_ = false;
  bool more_left_ = false;
};

} // namespace rowe::service
