// SPDX-License-Identifier: Apache-2.0
// Puts frames of messages into a batch. On a server the slot holds the complete frame (header, head, body)
// that every peer of the shared codec gets. On a client the frame is masked as it is copied into the batch.
// For a peer whose codec writes another head, header and head are written in front of the slot's body.
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>

#include "service/batch.hpp"
#include "service/core_state.hpp"
#include "service/slot_pool.hpp"
#include "wire/codec.hpp"

namespace rowe::service {

class message_frames {
 public:
  message_frames(core_state& state, slot_pool& slots) noexcept
      : protocols_{state.seams.protocols}, subscription_rows_{state.subscriptions.all()}, slots_{slots} {}

  // Adds the frame of the slot, without its first `skip` bytes. False: the batch has no room for it.
  bool add_shared(bool masked, std::size_t skip, batch& into, const batch_piece& of) const noexcept;
  // As add_shared(), with a head of its own.
  bool add_headed(bool masked, std::size_t skip, batch& into, const batch_piece& of,
                  const wire::message_head& head) const noexcept;
  // The head that the codec of a subscription writes.
  wire::message_head head_of(const batch_piece& of) const noexcept;

 private:
  const wire::protocol_set& protocols_;
  const rows<subscription_id, subscription> subscription_rows_;
  slot_pool& slots_;
};

} // namespace rowe::service
