// SPDX-License-Identifier: Apache-2.0
#include "service/calls/message_parking.hpp"

namespace rowe::service {

void message_parking::forget(peer_index peer) noexcept {
  rows_[peer] = {};
  if (std::exchange(outbox_.of(peer).marked_full, false)) --marked_full_;
  room_came_ = true; // a sender that waits for room there need not wait any more
}

bool message_parking::park(peer_index to, bool before) noexcept {
  if (!to) {
    ++now_.parked;
    ++now_.for_everyone;
    return true;
  }
  row& of = rows_[to];
  if (std::exchange(of.turn, turn_) != turn_) of.count = 0;
  if (!before && of.count + now_.parked >= now_.slots) return false;
  ++of.count;
  ++now_.parked;
  if (now_.of_receiver) receiver_.count_answer(to);
  if (of.count + now_.parked >= now_.slots && !std::exchange(outbox_.of(to).marked_full, true)) {
    ++marked_full_;
    state_.shared.set_taking(to.value, 0);
  }
  return true;
}

void message_parking::show_room() noexcept {
  for (const peer_index i : state_.peers.ids()) {
    peer_queues& queues = outbox_.of(i);
    if (!queues.marked_full || rows_[i].turn > cycle_turn_) continue;
    queues.marked_full = false;
    --marked_full_;
    state_.shared.set_taking(i.value, state_.peers[i].id.generation);
    ++state_.cycle.places_freed;
    room_came_ = true;
  }
}

// ---- checks

bool message_parking::check() const noexcept {
  std::uint32_t marked_full = 0;
  for (const peer_index i : state_.peers.ids())
    marked_full += state_.peers[i].state != connection::phase::free && outbox_.of(i).marked_full;
  return marked_full == marked_full_;
}

} // namespace rowe::service
