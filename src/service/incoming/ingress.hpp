// SPDX-License-Identifier: Apache-2.0
// Folder incoming: from the bytes of a peer to a message that is whole and allowed. It carries none out.
// What was read from peers and is not carried out yet. If several peers have sent something, reading only
// stages it. Then one message of each peer is carried out in turn (turns.hpp), and one cycle does a stated
// amount of work. So a peer waits for one message of every other peer, not for all that they have sent. A
// stop does not even wait for that: it is carried out as it is read, before what its own peer sent before it.
//
// A message for which the receiver has no room is parked. Its peer is not read until there is room. One that
// takes several steps is parked in the same way, and comes again in its peer's next turn.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/index_ring.hpp"
#include "service/incoming/frame_handler.hpp"
#include "service/incoming/receiver.hpp"
#include "service/incoming/turns.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"
#include "wire/websocket/frame_parser.hpp"

namespace rowe::service {

struct ingress_needs {
  core_state& state_;
  const outbox& outbox_;
  sender& sender_;
  receiver& receiver_;
  frame_handler& frame_handler_;
};

class ingress : ingress_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  ingress(rt::arena& memory, const ingress_needs& parts) noexcept;

  void open(peer_index peer) noexcept;
  void forget(peer_index peer) noexcept;

  // How many bytes of a peer are wanted now. None while staged bytes are still to be carried out.
  std::size_t wanted_bytes(peer_index peer) const noexcept;
  // Takes what was read. Stops among it are carried out now; if the peer was alone, all messages are.
  void receive(peer_index peer, std::span<std::byte> bytes) noexcept;
  // Peers whose parked message has room now wait for their turn.
  void unpark() noexcept {
    if (!parked_.empty()) look_at_parked();
  }
  // Carries out one message of each waiting peer, in turn.
  void read_in_turn() noexcept {
    if (!turns_.empty()) read_backlogs();
  }
  // Begins a cycle: stops may be carried out before their turn again.
  void begin_cycle() noexcept { stops_ahead_ = 0; }
  // Whether the next cycle is needed at once: something waits for its turn, or room came for what is parked.
  bool waits() const noexcept { return !turns_.empty() || (!parked_.empty() && changes() != unparked_at_); }
  // Whether a message is parked until the receiver has room.
  bool any_parked() const noexcept { return !parked_.empty(); }

  // Parks the message that is being carried out: the receiver has no room for it.
  void park(peer_index peer) noexcept;
  // How the long message begins that is being carried out, or a piece of it is.
  std::span<const std::byte> front(peer_index peer) const noexcept { return inputs_[peer].parser.front(); }
  // The message that is being carried out takes more than a step: its peer's next turn goes on with it.
  void go_on(peer_index peer) noexcept;
  // Whether its message was parked.
  bool parked(peer_index peer) const noexcept { return inputs_[peer].parked() && !inputs_[peer].goes_on; }
  // When the unfinished message of a peer began; never: there is none.
  rt::time_point unfinished_since(peer_index peer) const noexcept { return inputs_[peer].message_began_at; }

  // Counts how often there was new room for anything that waits.
  std::uint64_t room_changes() const noexcept { return outbox_.room_changes() + state_.cycle.places_freed; }

  bool check() const noexcept;

 private:
  // What comes from one peer.
  struct input {
    wire::frame_parser parser;
    std::span<std::byte> assembly; // where a fragmented message is assembled
    std::span<std::byte> staging;  // capacity for what is read while other peers have their turn,
    std::span<std::byte> backlog;  // and the part of it that is not carried out yet
    // The parked message, before the backlog. Null: none is parked.
    std::byte* parked_text = nullptr;
    std::uint32_t parked_bytes = 0;
    bool parked_binary = false;
    bool goes_on = false;      // it waits for nothing but its peer's turn
    bool in_ring = false;      // in turns_ or parked_
    bool left_backlog = false; // the last read that was large was not carried out in one turn
    rt::time_point message_began_at = rt::never;
    std::size_t timed = 0; // bytes of a long message since then

    bool parked() const noexcept { return parked_text != nullptr; }
  };

  std::uint64_t changes() const noexcept { return room_changes() + receiver_.looks_wanted(); }
  void keep_current(peer_index peer) noexcept;
  void look_at_parked() noexcept;
  void read_backlogs() noexcept;
  void read_alone(peer_index peer, std::span<std::byte> bytes) noexcept;
  std::size_t read_one(peer_index peer) noexcept;
  void take_turn(peer_index peer) noexcept;
  void keep_backlog(input& of) noexcept;
  void end_backlog(peer_index peer) noexcept;
  void take_stops(peer_index peer) noexcept;
  bool take_if_stop(peer_index peer, std::span<const std::byte> frame) noexcept;

  rows<peer_index, input> inputs_;
  turns turns_;
  index_ring<peer_index> parked_;
  std::uint64_t unparked_at_ = 0;     // changes() when parked messages were tried last
  std::span<std::byte> current_text_; // the message that is being carried out
  bool current_binary_ = false;
  std::span<const std::byte> lent_; // all that was read with it, if that is in the transport's memory
  std::uint32_t stops_ahead_ = 0;   // how many in this cycle
};

} // namespace rowe::service
