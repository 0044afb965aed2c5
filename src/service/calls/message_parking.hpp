// SPDX-License-Identifier: Apache-2.0
// The shares of senders' slots that parked direct messages may hold. A message that finds no room is parked:
// it holds a slot of its sender, and is posted again in the sender's next turn. Parked messages may have
// three quarters of a sender's slots, and one peer as many of those as are left: half of them, if it is
// alone. So messages to other peers find a slot. The receiver may park in all of its slots: it limits what it
// takes from a peer, so each answer finds one.
//
// When a peer's share is used up, senders to it get `full` before they take a slot, until nothing is parked
// for it. What they submitted before ends with `full`. A message to everyone is always parked, but its
// senders get `full` just as early.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/shares.hpp"
#include "service/incoming/receiver.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

class message_parking {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(bounds.connections_max);
  }
  message_parking(rt::arena& memory, core_state& state, outbox& out, receiver& inbox) noexcept
      : state_{state},
        outbox_{out},
        receiver_{inbox},
        rows_{memory.carve<row>(state.bounds().connections_max)} {}

  void forget(peer_index peer) noexcept {
    rows_[peer] = {};
    if (std::exchange(outbox_.of(peer).marked_full, false)) --marked_full_;
    room_came_ = true; // a sender that waits for room there need not wait any more
  }

  // Begins the turn of a sender with this many slots: a handle, or the submission queue.
  void begin_turn(std::uint32_t slots, bool of_receiver) noexcept {
    ++turn_;
    now_ = {.slots = of_receiver ? slots : slots - reserve_of(slots), .of_receiver = of_receiver};
    if (of_receiver) receiver_.begin_answers();
  }
  // Whether a message to the peer, or to everyone, was parked in this turn.
  bool any_for(peer_index peer) const noexcept { return rows_[peer].turn == turn_; }
  bool any_for_everyone() const noexcept { return all_parked_in_ == turn_; }
  // No peer has room. So no later message of this turn may overtake the one that found none.
  void hold_back_later_ones() noexcept { all_parked_in_ = turn_; }
  // Parks a message to the peer; none: to everyone. False: the peer's share is used up. A message that was
  // parked `before` is counted in each turn; it stays parked, whatever the shares are now.
  bool park(peer_index to, bool before) noexcept {
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
  // Too many messages to everyone are parked: the sender of this turn gets `full` before it takes a slot.
  bool refuses_to_everyone() const noexcept {
    return now_.for_everyone != 0 && now_.for_everyone + now_.parked >= now_.slots;
  }

  void begin_cycle() noexcept { cycle_turn_ = turn_; }
  // At the end of a cycle: publishes to senders which peers have room again. True if there is such a peer, or
  // a peer has left.
  bool renew_room() noexcept {
    if (marked_full_ != 0) show_room();
    return std::exchange(room_came_, false);
  }

  bool check() const noexcept {
    std::uint32_t marked_full = 0;
    for (const peer_index i : state_.peers.ids())
      marked_full += state_.peers[i].state != connection::phase::free && outbox_.of(i).marked_full;
    return marked_full == marked_full_;
  }

 private:
  // Of one peer.
  struct row {
    std::uint64_t turn = 0;  // the newest turn in which a message to it was parked,
    std::uint32_t count = 0; // and how many in that turn
  };

  struct turn {
    std::uint32_t slots = 0;        // how many may be parked,
    std::uint32_t parked = 0;       // how many are,
    std::uint32_t for_everyone = 0; // and how many of these are for everyone
    bool of_receiver = false;
  };

  void show_room() noexcept {
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

  core_state& state_;
  outbox& outbox_;
  receiver& receiver_;
  const rows<peer_index, row> rows_;
  turn now_;
  std::uint64_t turn_ = 0;          // counts the turns of senders
  std::uint64_t cycle_turn_ = 0;    // the last one before this cycle
  std::uint64_t all_parked_in_ = 0; // the newest turn in which a message to everyone was parked
  bool room_came_ = false;          // a peer has room again, or has left
  std::uint32_t marked_full_ = 0;   // how many peers are marked_full
};

} // namespace rowe::service
