// SPDX-License-Identifier: Apache-2.0
// Messages in several frames.
#include "service/outgoing/frame_selection.hpp"

#include <utility>

namespace rowe::service {

// A message in several frames is under way.
void frame_selection::add_diverted(const recipient& to, partial_frame& frame, batch& into) noexcept {
  if (frame.is_continued()) return add_next_fragment(to, frame, into);
  if (frame.goes == partial_frame::way::between) { // its rest is in this batch; then it is over
    into.more = true;
    return;
  }
  into.in_fragments = long_fragments_per_turn; // each byte takes longer
  const queue* const its_own = frame.from;
  const bool others = partial_frames_.may_set_aside();
  // So few that no turn takes long, and what comes behind them is chosen anew.
  const auto add_some_texts = [&] {
    return add_texts(to, frame, into, urgent_frames_.room(to.index, priority::normal),
                     text_fragment_bytes_max);
  };
  if (!others) return (void)add_some_texts();
  if (!add_others(to, 0, its_own, into)) return;
  // By turns, for a socket may take little more than what is first.
  const bool texts_first = !std::exchange(frame.others_next, !frame.others_next);
  if (texts_first && !add_some_texts()) return;
  for (std::size_t p = 1; p < to.queues.ready.size(); ++p) {
    if (!add_others(to, p, its_own, into)) return;
  }
  if (!texts_first) (void)add_some_texts();
}

// Other messages of one priority, but for those of one queue, which keep their order behind a message of it.
bool frame_selection::add_others(const recipient& to, std::size_t at, const queue* but,
                                 batch& into) noexcept {
  peer_queues& from = to.queues;
  const priority replies_at = to.peer.ours == side::client ? priority::urgent : priority::normal;
  into.credit = urgent_frames_.room(to.index, static_cast<priority>(at));
  const auto add = [&](queue& one, subscription_id of) {
    return one.empty() || (&one == but && !ROWE_MUTANT(fragments_passed)) || add_queue(to, one, of, into);
  };
  if (at == static_cast<std::size_t>(replies_at) && !(add(from.replies, {}) && add(from.long_replies, {})))
    return false;
  if (!add(from.direct[at], {})) return false;
  for (subscription_id i = from.ready[at].head; i; i = subscription_rows_[i].next_ready) {
    if (!add(subscription_rows_[i].pending, i)) return false;
  }
  return true;
}

bool frame_selection::add_all_left(const recipient& to, batch& into) noexcept {
  partial_frame& frame = partial_frames_.of(to.index);
  const bool texts = frame.goes == partial_frame::way::texts;
  if (texts && !to.queues.blocked && !to.queues.out_of_credit) return false; // it goes on
  if (add_partial(to, into) && texts) {
    // Between two fragments an urgent frame may have been begun.
    if (!frame.mid_frame()) urgent_frames_.gather_begun(to.index, into);
    (void)add_texts(to, frame, into, SIZE_MAX, SIZE_MAX);
  }
  return into.count != 0;
}

// Fragments, until the batch has so many bytes more, or the credit is used up. False: they are not all.
bool frame_selection::add_texts(const recipient& to, partial_frame& frame, batch& into, std::size_t credit,
                                std::size_t bytes) noexcept {
  into.credit = credit;
  partial_frame next = frame;
  if (next.mid_frame()) { // its rest is in this batch
    next.done += std::exchange(next.fragment, 0);
    next.written = 0;
    ++next.number;
    into.more = true;
  }
  const std::size_t most = bytes == SIZE_MAX ? bytes : into.bytes + bytes;
  for (bool first = true; next.done != next.payload && into.bytes < most; first = false) {
    if ((into.full() || into.bytes >= into.credit) && !urgent_frames_.may_go_on(to.index, into)) return false;
    batch_piece piece{.slot = next.slot, .is = batch_piece::origin::partial, .own_head = next.own_head};
    if (to.masked) piece.key = mask_keys_.next();
    into.more = true;
    if (!message_frames_.add_fragment(to.masked, next, into, piece)) return false;
    if (first && !frame.mid_frame()) frame.place = next.place; // what is read later is not before that
    next.done += into.pieces[into.count - 1].fragment;
    ++next.number;
  }
  return true;
}

// A batch takes one fragment, so that what comes next is chosen anew behind it.
void frame_selection::add_next_fragment(const recipient& to, partial_frame& frame, batch& into) noexcept {
  into.in_fragments = 1;
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

// Adds the first fragment of a message, if it goes in several frames to this peer. Nothing follows in the
// batch. One that would have to wait for another one lets others pass.
frame_selection::beginning frame_selection::begin_in_frames(const recipient& to, batch& into,
                                                            const batch_piece& piece) noexcept {
  partial_frame frame = message_frames_.begun(piece, to.queues.whole_bytes_max);
  if (!frame.in_frames()) return beginning::whole;
  if (partial_frames_.of(to.index).diverts()) return beginning::waits;
  into.more = true;
  into.in_fragments = frame.is_continued() ? 1 : long_fragments_per_turn;
  (void)message_frames_.add_fragment(to.masked, frame, into, piece);
  return beginning::begun;
}

} // namespace rowe::service
