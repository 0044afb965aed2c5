// SPDX-License-Identifier: Apache-2.0
// Takes what threads of this process submit: messages, requests and replies, a stated budget in a cycle. What
// finds no room is parked, so that it does not hold up other threads. Service thread only; nothing waits or
// allocates. A user thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
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

  void take() noexcept {
    if (const std::uint64_t expired = state_.threads_inbox.expired(); expired != expired_)
      state_.counts.add(counter::inbound_expired, expired - std::exchange(expired_, expired));
    const bool receives = !receiver_.pair();
    if (receives) receiver_.mark_released();
    direct_messages_.parking().begin_turn(state_.submissions.slots(), receives);
    if (parked_count_ != 0) retry();
    const std::size_t taken = state_.submissions.take(
        [&](std::uint32_t slot) {
          if (!take_slot(slot, false)) parked_[parked_count_++] = slot; // there is a place for each
        },
        entries_per_cycle);
    more_left_ = taken == entries_per_cycle;
    if (receives) receiver_.count_released(taken);
    if (state_.submissions.refuse_to_everyone(direct_messages_.parking().refuses_to_everyone()))
      room_came_ = true;
  }
  // Tries parked submissions again, as if they came now.
  void retry() noexcept {
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < parked_count_; ++i) {
      const std::uint32_t slot = parked_[i];
      if (!take_slot(slot, true)) parked_[kept++] = slot;
    }
    state_.cycle.places_freed += parked_count_ - kept;
    parked_count_ = kept;
  }
  // At the end of a cycle: wakes threads that wait for room: there may be some. `at_peers`: a peer has new
  // room. Returns whether there is new room anywhere.
  bool notify_room(bool at_peers) noexcept {
    const bool came = std::exchange(room_came_, false) || at_peers;
    if (came) state_.submissions.notify_room();
    return came;
  }

  bool more_left() const noexcept { return more_left_; } // the next cycle is needed at once
  bool waits() const noexcept { return parked_count_ != 0; }
  bool drained() const noexcept { return state_.submissions.drained(); }

 private:
  // False: it must be parked until there is room.
  bool take_slot(std::uint32_t slot, bool parked) noexcept {
    // A copy: once the submission is completed, another thread may have the slot.
    const submission_header asked = state_.submissions.request(slot);
    const std::string_view text = state_.submissions.request_text(slot);
    const call_endpoint us{.who = call_endpoint::kind::thread, .index = slot};
    switch (asked.what) {
    case detail::entry::message: {
      const bool taken = direct_messages_.post({.text = text,
                                                .sender = asked.wants_outcome ? us : call_endpoint{},
                                                .to = asked.peer,
                                                .only_now = asked.expires == asked.stamped,
                                                .parked = parked,
                                                .expires = asked.expires});
      if (taken && !asked.wants_outcome) state_.submissions.complete(slot, {});
      return taken;
    }
    case detail::entry::invocation:
      call_router_.start({.caller = us,
                          .service = {},
                          .what = {.is = wire::call_args::form::object, .text = text},
                          .to = asked.peer,
                          .began = asked.stamped,
                          .deadline = asked.expires});
      return true;
    case detail::entry::reply:
    case detail::entry::refusal: {
      const call_endpoint waits = asked.wants_outcome ? us : call_endpoint{};
      const status done =
          asked.what == detail::entry::refusal
              ? call_completion_.refuse(us, asked.call, text)
              : call_completion_.answer(us, asked.call,
                                        {.text = text,
                                         .expires = state_.cycle.expiry_of(asked.stamped, asked.expires),
                                         .waits = waits});
      if (!done || !asked.wants_outcome || asked.what == detail::entry::refusal)
        state_.submissions.complete(slot, done);
      return true;
    }
    case detail::entry::completion: break; // goes to handles only
    }
    return true;
  }

  std::span<std::uint32_t> parked_; // slots, in their order
  std::uint32_t parked_count_ = 0;
  std::uint64_t expired_ = 0; // there, and counted
  bool room_came_ = false;
  bool more_left_ = false;
};

} // namespace rowe::service
