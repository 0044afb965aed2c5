// SPDX-License-Identifier: Apache-2.0
// Puts frames of messages into a batch. On a server the slot holds the complete frame (header, head, body)
// that every peer of the shared codec gets. On a client the frame is masked as it is copied into the batch.
// For a peer whose codec writes another head, header and head are written in front of the slot's body. A long
// message goes in fragments, which are put together of the slot's envelope and of chunks. To a peer that
// asked for them any text that is too long goes in fragments that are texts themselves; each is written
// anew, from what it holds. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/slot_pool.hpp"
#include "service/outgoing/batch.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

class message_frames {
 public:
  message_frames(core_state& state, slot_pool& slots) noexcept
      : state_{state}, subscription_rows_{state.subscriptions.all()}, slots_{slots} {}

  // Adds the frame of the slot, without its first `skip` bytes. False: the batch has no room for it.
  bool add_shared(bool masked, std::size_t skip, batch& into, const batch_piece& of) const noexcept;
  // As add_shared(), with a head of its own.
  bool add_headed(bool masked, std::size_t skip, batch& into, const batch_piece& of,
                  const wire::message_head& head) const noexcept;
  // A message that goes in several frames to a peer that is sent no longer text whole; or else in one.
  partial_frame begun(const batch_piece& piece, std::size_t whole_bytes_max) const noexcept;
  // Adds a frame of such a message, without its first `of.written` bytes: the fragment that was begun, or the
  // next one. False: the batch has no room for it.
  bool add_fragment(bool masked, partial_frame& of, batch& into, const batch_piece& piece) const noexcept;
  // The head that the codec of its subscription writes, or that of plain messages.
  wire::message_head head_of(const batch_piece& of) const noexcept;
  // What is left of the message's time to live now that it goes into a batch. The clock is read once a batch,
  // for a cycle may be late; so nothing may be left.
  rt::duration left_of(slot_id slot, batch& into) const noexcept {
    if (into.clock_read == rt::time_point{}) into.clock_read = state_.clock();
    return slots_.lifetime(slot).ttl_over() -
           (ROWE_MUTANT(ttl_queued) ? slots_.published(slot) : into.clock_read);
  }

 private:
  std::size_t payload_bytes(const partial_frame& of) const noexcept;
  bool add_text(bool masked, partial_frame& of, batch& into, const batch_piece& piece) const noexcept;
  void copy_payload(partial_frame& of, std::size_t at, std::span<std::byte> into) const noexcept;

  core_state& state_;
  const rows<subscription_id, subscription> subscription_rows_;
  slot_pool& slots_;
};

} // namespace rowe::service
