// SPDX-License-Identifier: Apache-2.0
#include "service/handles/thread_submissions.hpp"

#include <string_view>

namespace rowe::service {

using detail::entry;

void thread_submissions::take() noexcept {
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

void thread_submissions::retry() noexcept {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < parked_count_; ++i) {
    const std::uint32_t slot = parked_[i];
    if (!take_slot(slot, true)) parked_[kept++] = slot;
  }
  state_.cycle.places_freed += parked_count_ - kept;
  parked_count_ = kept;
}

// False: it must be parked until there is room.
bool thread_submissions::take_slot(std::uint32_t slot, bool parked) noexcept {
  // A copy: once the submission is completed, another thread may have the slot.
  const submission_header asked = state_.submissions.request(slot);
  const std::string_view text = state_.submissions.request_text(slot);
  const call_endpoint us{.who = call_endpoint::kind::thread, .index = slot};
  switch (asked.what) {
  case entry::message: {
    const bool taken = direct_messages_.post({.text = text,
                                              .sender = asked.wants_outcome ? us : call_endpoint{},
                                              .to = asked.peer,
                                              .only_now = asked.expires == asked.stamped,
                                              .parked = parked,
                                              .expires = asked.expires});
    if (taken && !asked.wants_outcome) state_.submissions.complete(slot, {});
    return taken;
  }
  case entry::invocation:
    call_router_.start({.caller = us,
                        .service = {},
                        .what = {.is = wire::call_args::form::object, .text = text},
                        .to = asked.peer,
                        .began = asked.stamped,
                        .deadline = asked.expires});
    return true;
  case entry::reply:
  case entry::refusal: {
    const call_endpoint waits = asked.wants_outcome ? us : call_endpoint{};
    const status done =
        asked.what == entry::refusal
            ? call_completion_.refuse(us, asked.call, text)
            : call_completion_.answer(us, asked.call,
                                      {.text = text,
                                       .expires = state_.cycle.expiry_of(asked.stamped, asked.expires),
                                       .waits = waits});
    if (!done || !asked.wants_outcome || asked.what == entry::refusal)
      state_.submissions.complete(slot, done);
    return true;
  }
  case entry::completion: break; // goes to handles only
  }
  return true;
}

} // namespace rowe::service
