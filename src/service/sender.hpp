// SPDX-License-Identifier: Apache-2.0
// Writes what waits in the outbox: each peer that is scheduled gets what its queues have ready, many frames
// in one call of the transport. What is urgent goes first, then messages by their priority, the subscriptions
// of one priority in turn. What may be on its way to a peer is bounded by its credit, which pings measure
// (credit.hpp).
//
// A stop must not wait until a thousand peers are written to. So the peers take turns, and one cycle does a
// stated amount of work.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/batch.hpp"
#include "service/core_options.hpp"
#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/mask_keys.hpp"
#include "service/message_store.hpp"
#include "service/outbox.hpp"
#include "service/partial_frames.hpp"
#include "service/peer_table.hpp"
#include "service/timers.hpp"
#include "service/transport.hpp"
#include "service/urgent_frames.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

class sender {
 public:
  struct needs {
    const cycle_state& cycle;
    counters& counts;
    timers& due;
    peer_table& peers;
    router& topics;
    message_store& store;
    outbox& out;
    transport& carrier;
    entropy& random;
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  sender(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  void open(peer_index peer) noexcept { urgent_.open(peer); }
  // What it has in hand is lost.
  void forget(peer_index peer) noexcept;

  // ---- messages

  // Whoever is scheduled, in turn, up to the work of one cycle. What lives no longer than this cycle is
  // offered to all, however much work that is.
  void flush_all() noexcept {
    const bool to_all = store_.take_lives_no_longer();
    work_ = 0;
    if (out_.scheduled() != 0) flush_scheduled(to_all);
  }
  // Messages to one peer too: only when what is over has been taken out, by timers in this cycle.
  void flush(peer_index peer) noexcept;
  // Somebody has not had a turn since the round began: no more values are taken from handles until all have.
  bool round_open() const noexcept { return turn_left_ != 0; }
  // The transport has room again.
  void writable(peer_index peer) noexcept;
  // The peer is not read any more: its pongs lie behind what we do not read, so only the kernel's limit
  // holds.
  void ignore_credit(peer_index peer) noexcept;

  // ---- frames that pass messages

  void send_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept;
  // A close frame, unless it would stand in the middle of another frame; and everything in front of it.
  void send_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept;
  // An answer about the stop, written at once. Counted when it finds no room.
  void add_stop_reply(peer_index peer, std::span<const char> text) noexcept;
  // The stop's state, in the place of an older one.
  void add_stop_state(peer_index peer, std::span<const char> text) noexcept;

  // What is known of the way to a peer; and frames that it has a part of.
  urgent_frames& urgent() noexcept { return urgent_; }
  partial_frames& partial() noexcept { return partial_; }
  const partial_frames& partial() const noexcept { return partial_; }

  bool check() const noexcept;

 private:
  // Whom is written to, looked up once.
  struct recipient {
    peer_index index;
    connection& peer;
    peer_queues& queues;
    bool masked;
  };

  void count_message_out(connection& peer) noexcept;
  void flush_scheduled(bool to_all) noexcept;
  void flush_urgent(peer_index peer) noexcept;
  void write(const recipient& to, batch& what) noexcept;
  bool gather_urgent(const recipient& to, batch& into) noexcept;
  void gather_messages(const recipient& to, batch& into) noexcept;
  bool gather_partial(const recipient& to, batch& into) noexcept;
  bool gather_queue(const recipient& to, queue& from, std::uint32_t of, batch& into) noexcept;
  bool gather_frame(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept;
  bool gather_headed(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept;
  void commit(const recipient& to, batch& sent, std::size_t taken) noexcept;
  void commit_message(const recipient& to, const batch_piece& piece, std::size_t part) noexcept;

  void hand_over_rest(const recipient& to) noexcept;

  counters& counts_;
  peer_table& peers_;
  const rows<subscription_id, subscription> subscriptions_;
  const wire::codec& envelope_;
  message_store& store_;
  outbox& out_;
  wire_slots& slots_;
  transport& carrier_;
  mask_keys keys_;
  urgent_frames urgent_;
  partial_frames partial_;
  std::span<std::byte> buffer_;   // a batch of frames,
  std::span<batch_piece> pieces_; // and where they came from
  std::uint32_t turn_left_ = 0;   // how many of those scheduled have not had their share of this round
  std::size_t work_ = 0;          // of this cycle
};

} // namespace rowe::service
