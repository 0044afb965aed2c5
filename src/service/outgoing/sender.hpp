// SPDX-License-Identifier: Apache-2.0
// Folder outgoing: from an encoded message to sockets and handles. Who gets it is decided elsewhere.
// Writes the messages in the outbox. Each scheduled peer gets what its queues have ready, many frames in one
// call of the transport. Urgent frames go first, then messages by their priority; the subscriptions of one
// priority take turns. A peer's credit bounds what may be on its way to it; pings measure the credit
// (credit.hpp). A stop must not wait until a thousand peers have been written to. So the peers take turns,
// and one cycle does a stated amount of work. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/outgoing/batch.hpp"
#include "service/outgoing/frame_group.hpp"
#include "service/outgoing/frame_selection.hpp"
#include "service/outgoing/mask_keys.hpp"
#include "service/outgoing/message_frames.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/outgoing/subscription_queues.hpp"
#include "service/outgoing/urgent_frames.hpp"
#include "service/state/core_state.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {

struct sender_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  subscription_queues& subscription_queues_;
};

class sender : sender_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  sender(rt::arena& memory, const sender_needs& parts) noexcept;

  void open(peer_index peer) noexcept { urgent_.open(peer); }
  // A peer has left: its partial frame is lost.
  void forget(peer_index peer) noexcept;

  // ---- messages

  // Writes to the scheduled peers in turn, up to the work of one cycle. If a message expires with this cycle,
  // it writes to all of them, however much work that is.
  void flush_all() noexcept {
    const bool to_all = message_store_.take_expires_this_cycle();
    work_ = 0;
    if (outbox_.scheduled() != 0) flush_scheduled(to_all);
  }
  // Writes to one peer. Only after timers have dropped what has expired by this cycle.
  void flush(peer_index peer) noexcept;
  // Whether a peer has not had its turn in this round. Then no values are taken from handles.
  bool round_open() const noexcept { return turn_left_ != 0; }
  // The transport has room again.
  void writable(peer_index peer) noexcept;
  // The peer is not read any more. Its pongs are not read either, so credit cannot be measured, and only the
  // kernel's limit holds.
  void ignore_credit(peer_index peer) noexcept;

  // ---- urgent frames

  void send_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept;
  // Writes a close frame after all that goes before it; none in the middle of another frame.
  void send_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept;
  // Writes an answer about the stop at once. Counted as lost if there is no room for it.
  void add_stop_reply(peer_index peer, std::span<const char> text,
                      wire::message_kind kind = wire::message_kind::text) noexcept;
  // Writes the state of the stop; it replaces an older state that is not written yet.
  void add_stop_state(peer_index peer, std::span<const char> text,
                      wire::message_kind kind = wire::message_kind::text) noexcept;

  // The urgent frames and the credit of each peer; and the frames that are partly written.
  urgent_frames& urgent() noexcept { return urgent_; }
  partial_frames& partial() noexcept { return partial_; }
  const partial_frames& partial() const noexcept { return partial_; }

  bool check() const noexcept;

 private:
  void count_message_out(connection& peer) noexcept;
  void flush_scheduled(bool to_all) noexcept;
  void flush_urgent(peer_index peer) noexcept;
  void write_group() noexcept;
  std::size_t hand_over(connection_id to, std::span<const std::byte> bytes) noexcept;
  void settle(const recipient& to, batch& sent, std::size_t taken) noexcept;
  void commit(const recipient& to, batch& sent, std::size_t taken) noexcept;
  void commit_message(const recipient& to, const batch_piece& piece, std::size_t part) noexcept;
  void commit_partial(const recipient& to, const batch_piece& piece, std::size_t part) noexcept;
  void commit_first_fragment(const recipient& to, const batch_piece& piece, std::size_t part) noexcept;
  void hand_over_rest(const recipient& to) noexcept;

  const rows<subscription_id, subscription> subscription_rows_;
  const message_frames frames_;
  mask_keys keys_;
  urgent_frames urgent_;
  partial_frames partial_;
  frame_selection selection_;
  frame_group group_;
  std::span<std::byte> buffer_;   // a batch of frames,
  std::span<batch_piece> pieces_; // and where each came from
  std::uint32_t turn_left_ = 0;   // how many scheduled peers have not had their turn in this round
  std::size_t work_ = 0;          // done in this cycle
};

} // namespace rowe::service
