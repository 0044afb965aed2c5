// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/sender.hpp"

#include <algorithm>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {
namespace {

// A batch has capacity for the largest message, with all headers that may precede it.
std::size_t buffer_bytes(const limits& bounds) noexcept {
  return std::max(batch_bytes_max, slot_pool::large_bytes(bounds) + sizeof(wire::message_head::bytes) +
                                       wire::frame_header_bytes_max + sizeof(control_frames) +
                                       sizeof(stop_frames));
}

} // namespace

std::size_t sender::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return mask_keys::footprint_bytes() + urgent_frames::footprint_bytes(bounds) +
         partial_frames::footprint_bytes(bounds) + arena::bytes_for(buffer_bytes(bounds)) +
         arena::bytes_for<batch_piece>(batch_pieces_max);
}

sender::sender(rt::arena& memory, const sender_needs& parts) noexcept
    : sender_needs{parts},
      subscription_rows_{state_.subscriptions.all()},
      frames_{state_, message_store_.slots()},
      keys_{memory, state_.seams.random},
      urgent_{memory, {state_, outbox_, keys_}},
      partial_{memory, {state_, message_store_, outbox_}},
      selection_{{state_, message_store_, outbox_, keys_, urgent_, partial_, frames_}},
      group_{{state_, message_store_, outbox_, urgent_, partial_, frames_}},
      buffer_{memory.carve_bytes(buffer_bytes(state_.bounds()))},
      pieces_{memory.carve<batch_piece>(batch_pieces_max)} {}

// ---- peers

void sender::forget(peer_index peer) noexcept {
  while (partial_.of(peer)) { // perhaps with a message that was set aside
    partial_.end(peer);
    state_.counts.add(counter::lost_with_peer);
  }
}

void sender::writable(peer_index peer) noexcept {
  outbox_.of(peer).blocked = false;
  outbox_.schedule(peer);
}

void sender::ignore_credit(peer_index peer) noexcept {
  if (outbox_.of(peer).out_of_credit) outbox_.schedule(peer);
}

// ---- turns

// A peer that has more to write after its turn goes behind those that have not had theirs. Until all have had
// their turn, no more values are taken from handles: newer values would evict what was not offered yet.
void sender::flush_scheduled(bool to_all) noexcept {
  if (turn_left_ == 0) turn_left_ = outbox_.scheduled();
  for (std::uint32_t left = outbox_.scheduled(); left != 0; --left) {
    if (!to_all && work_ + group_.count() >= write_work_per_cycle) break;
    const peer_index next = outbox_.take_scheduled();
    if (turn_left_ != 0) --turn_left_;
    if (state_.peers[next].state == connection::phase::free) continue;
    if (const subscription_id only = outbox_.of(next).only_ready()) {
      if (group_.full() && ROWE_MUTANT(group_full)) continue;
      if (group_.full()) write_group();
      if (group_.add(next, only)) continue;
    }
    if (group_.count() != 0 && !ROWE_MUTANT(group_before)) write_group(); // who came before is written before
    flush(next);
  }
  if (group_.count() != 0) write_group();
}

// First all frames, then all commits: see frame_group.hpp.
void sender::write_group() noexcept {
  const std::span<frame_group::member> group = group_.take();
  for (frame_group::member& one : group) one.taken = hand_over(one.id, one.frame);
  for (frame_group::member& one : group) {
    const recipient to{one.peer, state_.peers[one.peer], outbox_.of(one.peer), false};
    batch sent{buffer_, {&one.piece, 1}};
    sent.bytes = one.frame.size();
    sent.count = 1;
    to.queues.out_of_credit = false;
    if (ROWE_MUTANT(group_refused) && one.taken == 0) continue;
    settle(to, sent, ROWE_MUTANT(group_place) ? group.front().taken : one.taken);
    to.queues.scheduled = false;
  }
}

void sender::flush(peer_index peer) noexcept {
  peer_queues& queues = outbox_.of(peer);
  const recipient to{peer, state_.peers[peer], queues, urgent_.masks(peer)};
  // It counts as scheduled meanwhile, so that nothing schedules it twice. What stays unwritten waits for a
  // pong, for room in the transport, or for the end of a partial frame. That schedules the peer again.
  const bool scheduled = std::exchange(queues.scheduled, true);
  bool more = true;
  unsigned fragments = 0; // of long messages
  for (unsigned round = 0; more && round < batches_per_cycle && !queues.blocked; ++round) {
    const bool placed = queues.latched_pending != 0 &&
                        subscription_queues_.place_pending_latched(peer); // first, since it may evict
    batch next{buffer_, pieces_};
    if (selection_.add_urgent(to, next)) selection_.add_messages(to, next);
    queues.out_of_credit = next.out_of_credit;
    const bool waited = queues.waits_to_begin;
    settle(to, next, next.count != 0 ? hand_over(to.peer.id, next.whole()) : 0);
    const bool may_begin_now = waited && !queues.waits_to_begin; // its own partial frame has ended
    const bool more_latched = queues.latched_pending != 0 && (placed || next.count != 0) &&
                              !next.out_of_credit && !queues.waits_to_begin;
    more = next.more || more_latched || may_begin_now;
    if ((fragments += next.in_fragments) >= long_fragments_per_turn) break;
  }
  queues.scheduled = scheduled;
  if (more) outbox_.schedule(peer);
}

// Writes the frames that do not wait for the end of the cycle; messages follow then.
void sender::flush_urgent(peer_index peer) noexcept {
  const recipient to{peer, state_.peers[peer], outbox_.of(peer), urgent_.masks(peer)};
  if (!to.queues.blocked) {
    batch next{buffer_, pieces_};
    (void)selection_.add_urgent(to, next); // no message follows in this batch
    settle(to, next, next.count != 0 ? hand_over(to.peer.id, next.whole()) : 0);
  }
  outbox_.schedule(peer);
}

inline std::size_t sender::hand_over(connection_id to, std::span<const std::byte> bytes) noexcept {
  const std::size_t taken = state_.seams.transport.write(to, bytes);
  work_ += 1 + taken / write_work_bytes;
  return taken;
}

inline void sender::settle(const recipient& to, batch& sent, std::size_t taken) noexcept {
  state_.counts.add(counter::bytes_out, taken);
  urgent_.wrote(to.index, taken);
  to.queues.blocked = taken < sent.bytes;
  commit(to, sent, taken);
  if (partial_.of(to.index)) hand_over_rest(to);
}

// ---- commit

// Frames that were written whole are done, one may be partial, and the others stay queued.
inline void sender::commit(const recipient& to, batch& sent, std::size_t taken) noexcept {
  for (std::size_t i = 0; i < sent.count; ++i) {
    const batch_piece& piece = sent.pieces[i];
    const std::size_t part = std::min<std::size_t>(taken, piece.bytes);
    taken -= part;
    const bool whole = part == piece.bytes;
    switch (piece.is) {
    case batch_piece::origin::stop: urgent_.commit_stop(to.index, part); break;
    case batch_piece::origin::control: urgent_.commit_control(to.index, part); break;
    case batch_piece::origin::partial: commit_partial(to, piece, part); break;
    case batch_piece::origin::message:
      if (part != 0) commit_message(to, piece, part);
    }
    if (!whole) break;
  }
  subscription_queues_.rotate_ready(to.index);
}

// The socket has taken the first `part` bytes of a message, or all of it.
inline void sender::commit_message(const recipient& to, const batch_piece& piece, std::size_t part) noexcept {
  outbox_.take_front(*piece.from, piece.slot);
  if (piece.subscription) subscription_queues_.mark_served(piece.subscription);
  if (piece.fragment != 0) [[unlikely]]
    return commit_first_fragment(to, piece, part);
  if (part == piece.bytes) {
    count_message_out(to.peer);
    return message_store_.delivered(piece.slot);
  }
  partial_frame rest{.slot = piece.slot,
                     .written = static_cast<std::uint32_t>(part),
                     .key = piece.key,
                     .own_head = piece.own_head};
  if (piece.own_head) rest.head = frames_.head_of(piece);
  partial_.begin(to.index, rest);
}

void sender::commit_partial(const recipient& to, const batch_piece& piece, std::size_t part) noexcept {
  partial_frame& frame = partial_.of(to.index);
  if (piece.fragment != 0) frame.begin_fragment(piece.fragment, piece.key);
  if (!partial_.advance(to.index, part, part == piece.bytes)) return;
  count_message_out(to.peer);
  message_store_.note_sent(frame.slot);
  partial_.end(to.index);
}

// The first fragment, or a part of it.
void sender::commit_first_fragment(const recipient& to, const batch_piece& piece, std::size_t part) noexcept {
  partial_frame begun = frames_.begun(piece, to.queues.whole_bytes_max);
  begun.begin_fragment(piece.fragment, piece.key);
  partial_.begin(to.index, begun);
  commit_partial(to, piece, part);
}

void sender::count_message_out(connection& peer) noexcept {
  state_.counts.add(counter::messages_out);
  ++peer.messages_out;
}

// The transport stores the rest of the frame itself, if it can; of a message in texts that waits, all. Only
// what was refused may be handed over, so what lacks credit is written first.
void sender::hand_over_rest(const recipient& to) noexcept {
  while (partial_.of(to.index) && partial_.is_worth_handing_over(to.index)) {
    batch rest{buffer_, pieces_};
    if (!selection_.add_all_left(to, rest)) return;
    const bool refused = to.queues.blocked;
    const std::size_t taken = refused ? state_.seams.transport.write_rest(to.peer.id, rest.whole())
                                      : state_.seams.transport.write(to.peer.id, rest.whole());
    to.queues.blocked = refused || taken < rest.bytes;
    state_.counts.add(counter::bytes_out, taken);
    urgent_.wrote(to.index, taken);
    commit(to, rest, taken);
    if (refused && taken < rest.bytes) return;
  }
}

// ---- urgent frames

void sender::send_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept {
  (void)urgent_.add_control(peer, what, payload); // a peer without control frames gets none
  outbox_.schedule(peer);
}

void sender::send_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept {
  if (partial_.of(peer).mid_frame() || !urgent_.add_close(peer, code, reason)) return;
  outbox_.schedule(peer);
  flush(peer);
}

void sender::add_stop_reply(peer_index peer, std::span<const char> text, wire::message_kind kind) noexcept {
  if (text.empty() || !urgent_.add_stop_reply(peer, text, opcode_of(kind)))
    return state_.counts.add(counter::stop_answers_lost);
  count_message_out(state_.peers[peer]);
  flush_urgent(peer);
}

void sender::add_stop_state(peer_index peer, std::span<const char> text, wire::message_kind kind) noexcept {
  if (text.empty() || !urgent_.add_stop_state(peer, text, opcode_of(kind))) return;
  count_message_out(state_.peers[peer]);
  outbox_.schedule(peer);
}

// ---- checks

// A peer with something to write is scheduled, or it waits for what will schedule it: room in the transport,
// a pong, or the end of a partial frame.
bool sender::check() const noexcept {
  for (const peer_index i : state_.peers.ids()) {
    const peer_queues& queues = outbox_.of(i);
    if (!state_.peers[i].open() || queues.scheduled || queues.blocked) continue;
    const bool needs_pong = queues.out_of_credit && urgent_.waits_for_pong(i);
    if (partial_.of(i).in_frames() && needs_pong && !partial_.of(i).mid_frame()) continue;
    if (partial_.of(i) || urgent_.any(i)) return false;
    const bool others_end = queues.waits_to_begin && partial_.wakes_who_waits();
    if (needs_pong || others_end) continue;
    if (subscription_queues_.any_due(i)) return false;
  }
  return group_.count() == 0 && partial_.check() && turn_left_ <= outbox_.scheduled();
}

} // namespace rowe::service
