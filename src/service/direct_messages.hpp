// SPDX-License-Identifier: Apache-2.0
// Messages to one peer or to everyone, and the requests of calls: how each finds its peers, waits for them,
// and ends. A message is pending while no peer takes it: none is there, none has room, or those that had it
// left before they were given it.
//
// What finds no room is parked: it keeps a slot of its sender's, and is posted again in the sender's next
// turn. What is for one peer may have as many of these slots as nobody has, and all together three quarters;
// so whatever is for others finds one. Of whoever receives it may have all: what is taken from peers is
// limited there, so that each answer finds room. From then on senders are told `full` before they take a
// slot, until nothing waits for that peer any more; what was under way by then ends so. What is for everyone
// waits whole, since its sender counts on that; but its sender is told `full` as soon.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/detail/lane.hpp>
#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/board.hpp"
#include "service/calls.hpp"
#include "service/cycle_state.hpp"
#include "service/letters.hpp"
#include "service/local_delivery.hpp"
#include "service/outbox.hpp"
#include "service/peer_table.hpp"
#include "service/receiver.hpp"
#include "json/reader.hpp"

namespace rowe::service {

struct direct_message {
  std::string_view text;
  party sender{};         // who is told what becomes of it; nobody
  detail::call_ref own{}; // of a handle
  detail::peer_ref to{};  // generation 0: everyone
  bool only_now = false;  // not to be queued beyond this cycle
  bool parked = false;    // it was before
  rt::time_point expires = rt::never;
  rowe::priority priority = rowe::priority::normal;
};

class direct_messages {
 public:
  struct needs {
    cycle_state& cycle;
    board& shown;
    peer_table& peers;
    call_table& calls;
    message_store& store;
    outbox& out;
    local_delivery& delivery;
    receiver& inbox;
    json::reader& validator;
    std::uint32_t claimants; // how many connections there may be, each with its claim
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return letters::footprint_bytes(bounds) + rt::arena::bytes_for<parked>(bounds.connections_max);
  }
  direct_messages(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  void forget(peer_index peer) noexcept;

  // ---- from this process

  // The turn of a handle, or of the front door, which has so many slots. Whoever receives has them for its
  // answers.
  void begin_turn(std::uint32_t slots, bool of_receiver) noexcept {
    ++turn_;
    turn_slots_ = of_receiver ? slots : slots - slots / 4;
    turn_parked_ = turn_parked_for_all_ = 0;
    turn_of_receiver_ = of_receiver;
    if (of_receiver) inbox_.begin_answers();
  }
  // False: the message is to be parked until its sender's next turn. Each peer gets what one sender has for
  // it in its order.
  bool post(const direct_message& m) noexcept;
  // Too many messages to everyone are parked: the sender of this turn is told `full` before it takes a slot.
  bool refuses_to_everyone() const noexcept {
    return turn_parked_for_all_ != 0 && turn_parked_for_all_ + turn_parked_ >= turn_slots_;
  }
  // At the end of a cycle: peers that have room again, since the beginning of this cycle, are shown so. True
  // when there was one, or one is gone.
  bool renew_room() noexcept {
    if (told_full_ != 0) show_room();
    return std::exchange(room_came_, false);
  }
  void begin_cycle() noexcept { cycle_turn_ = turn_; }

  // ---- of calls

  // The request of a call, which was composed; none: to the first peer that has room. Errors: full, and the
  // caller ends the call.
  status send_request(std::uint32_t slot, peer_index to, detail::call_ref call, bool stops) noexcept;
  // Whoever answered a call is told once its reply is written.
  void track_reply(std::uint32_t slot, const party& sender, detail::call_ref own) noexcept;
  // The request of a call that has ended is not sent any more, unless a socket is in the middle of it.
  void cancel(slot_ref which) noexcept;

  // ---- what is pending

  // To a peer, in their order, as far as it has room: it has come, or another one left before it was given
  // them. The rest goes on waiting. A request goes to the first who has room.
  void deliver_pending(peer_index peer) noexcept;
  // To whoever has got room since the last look.
  void place_pending() noexcept {
    if (pending() != 0) place_all_pending();
  }
  // The endpoint closes: they end.
  void close() noexcept;
  std::uint32_t pending() const noexcept { return messages_.waiting(); }

  // What became of messages since the last look: their senders are told.
  void take_outcomes() noexcept {
    if (store_.has_outcomes()) settle_outcomes();
  }

  bool check() const noexcept;

 private:
  // Of one peer.
  struct parked {
    std::uint64_t turn = 0;  // the newest in which a message to it was parked,
    std::uint32_t count = 0; // and how many in that turn
  };

  void add(counter which, std::uint64_t by = 1) noexcept { shown_.counts.add(which, by); }
  bool send(const direct_message& m) noexcept;
  void show_room() noexcept;
  void place_all_pending() noexcept;
  bool may_park(const direct_message& m, connection* to) noexcept;
  // What is over makes room; its outcome is taken at once, for it had a slot.
  bool has_room(peer_index to, priority at) noexcept {
    const bool has = out_.has_room(to, at);
    take_outcomes();
    return has;
  }
  bool has_room_for(const direct_message& m) noexcept;
  void begin(std::uint32_t slot, const letter& as) noexcept;
  bool queue_to(peer_index to, std::uint32_t slot) noexcept;
  void end_queueing(std::uint32_t slot) noexcept;
  void settle_outcomes() noexcept;
  void settle(std::uint32_t slot, bool evicted) noexcept;
  void end(std::uint32_t slot, const status& outcome) noexcept;

  const limits bounds_;
  cycle_state& cycle_;
  board& shown_;
  peer_table& peers_;
  call_table& calls_;
  message_store& store_;
  outbox& out_;
  wire_slots& slots_;
  local_delivery& delivery_;
  receiver& inbox_;
  json::reader& validator_;
  letters messages_;
  rows<peer_index, parked> parked_;
  std::uint64_t turn_ = 0;                // of senders
  std::uint64_t cycle_turn_ = 0;          // the last one before this cycle
  std::uint64_t all_parked_in_ = 0;       // the turn in which a message to everyone was
  std::uint32_t turn_slots_ = 0;          // of the sender whose turn it is,
  std::uint32_t turn_parked_ = 0;         // those parked in it,
  std::uint32_t turn_parked_for_all_ = 0; // and those of them for everyone
  bool turn_of_receiver_ = false;
  bool room_came_ = false;               // at a peer, or a peer is gone
  std::uint32_t told_full_ = 0;          // peers of which senders are told `full`
  std::uint64_t looked_for_room_at_ = 0; // after how many changes, for those that are pending
};

} // namespace rowe::service
