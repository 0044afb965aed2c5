// SPDX-License-Identifier: Apache-2.0
// Fragments of long messages.
#include "service/frame_selection.hpp"

namespace rowe::service {

// A batch takes one fragment, so that what comes next is chosen anew behind it.
void frame_selection::add_next_fragment(const recipient& to, partial_frame& frame, batch& into) noexcept {
  into.in_fragments = true;
  if (frame.mid_frame()) { // its rest is in this batch
    into.more = true;
    return;
  }
  into.credit = urgent_frames_.room(to.index, priority::normal);
  if ((into.full() || into.bytes >= into.credit) && !urgent_frames_.may_go_on(to.index, into)) return;
  batch_piece piece{.slot = frame.slot, .is = batch_piece::origin::partial, .own_head = frame.own_head};
  if (to.masked) piece.key = mask_keys_.next();
  (void)message_frames_.add_fragment(to.masked, frame, into, piece); // or in the next batch
  into.more = true;
}

// The first fragment of a long message. Nothing follows in the batch.
bool frame_selection::begin_long(const recipient& to, batch& into, const batch_piece& piece) noexcept {
  partial_frame frame{.slot = piece.slot, .own_head = piece.own_head};
  if (frame.own_head) frame.head = message_frames_.head_of(piece);
  frame.payload = message_frames_.payload_bytes(frame);
  into.in_fragments = into.more = true;
  (void)message_frames_.add_fragment(to.masked, frame, into, piece);
  return false;
}

} // namespace rowe::service
