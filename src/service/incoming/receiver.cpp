// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/receiver.hpp"

#include <algorithm>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"

namespace rowe::service {

receiver::receiver(rt::arena& memory, const receiver_needs& parts) noexcept
    : receiver_needs{parts},
      held_{memory.carve<held>(state_.bounds().connections_max)},
      claims_{state_.threads_inbox.slots(), state_.claimants(), receiver_claims_one_in} {}

// ---- selection

pair_index receiver::first_but(pair_index but) const noexcept {
  pair_index first{};
  for (const pair_index i : state_.pairs.ids()) {
    if (i == but || !state_.pair_rows[i].attached || state_.pairs[i].kind != detail::pair_kind::talk ||
        !state_.pairs[i].receives)
      continue;
    if (!first || state_.pair_rows[i].order < state_.pair_rows[first].order) first = i;
  }
  return first;
}

void receiver::detach(pair_index pair) noexcept {
  pair_ = first_but(pair);
  if (counted_ == pair) counted_ = unknown;
}

bool receiver::is_there() const noexcept {
  return pair_ || state_.options.answers_any || state_.threads_inbox.has_receiver();
}

// The counts begin again for a new receiver, which has no message yet. What the old one still has is not
// counted.
void receiver::begin() noexcept {
  counted_ = pair_;
  for (held& one : held_) one = {};
  untaken_ = answers_ = 0;
  claims_ = claims{slots(), state_.claimants(), receiver_claims_one_in};
  marked_ = false;
  state_.threads_inbox.forget_senders();
  taken_at_ = state_.cycle.now;
  ++state_.cycle.places_freed;
}

void receiver::forget(peer_index peer) noexcept {
  held& gone = held_[peer];
  untaken_ -= gone.untaken;
  claims_.give_back(gone.untaken, gone.untaken);
  answers_ -= std::exchange(gone.answers, 0);
}

void receiver::forget_answers() noexcept {
  answers_ = 0;
  for (held& one : held_) one.answers = 0;
}

// ---- released slots

inline void receiver::note_taken(detail::peer_ref from) noexcept {
  taken_at_ = state_.cycle.now;
  ++state_.cycle.places_freed;
  if (state_.peers.find({from.index, from.generation}) == nullptr) return;
  held& of = held_[{from.index}];
  if (of.untaken == 0) return;
  claims_.give_back(of.untaken);
  --untaken_;
}

void receiver::mark_released() noexcept {
  begin_if_new();
  if (marked_) return;
  marked_ = true;
  if (!counted_) {
    state_.threads_inbox.mark();
    before_mark_ = state_.submissions.submitted();
  } else {
    released_mark_ = state_.pairs[counted_].service.in.free_ring->mark();
    before_mark_ = state_.pairs[counted_].service.out.ring->pending_at_least();
  }
}

void receiver::count_released(std::size_t taken) noexcept {
  before_mark_ -= std::min<std::uint64_t>(before_mark_, taken);
  if (before_mark_ != 0) return;
  marked_ = false;
  // Slots that were released after the mark are found with the next mark.
  if (taken != 0) ++looks_wanted_;
  if (!counted_) {
    // How many slots are free now is not needed here.
    (void)state_.threads_inbox.collect_marked([this](detail::peer_ref from) { note_taken(from); });
    return;
  }
  const detail::producer_end& end = state_.pairs[counted_].service.in;
  end.free_ring->see(released_mark_, [&](std::uint32_t slot) { note_taken(end.memory.header(slot)->peer); });
}

void receiver::look() noexcept {
  begin_if_new();
  if (!counted_) state_.threads_inbox.ask_for_slots(); // a slot released before is found below
  mark_released();
  count_released(0);
}

// ---- shares

// The slots of the inbox, or of the queue for answers if these are fewer.
inline std::uint32_t receiver::slots() const noexcept {
  if (!counted_) return state_.threads_inbox.slots();
  const detail::queue_pair& by = state_.pairs[counted_];
  return std::min(by.service.in.count, by.user.out.count);
}

inline bool receiver::has_share(peer_index peer) const noexcept {
  const peer_queues& queues = outbox_.of(peer);
  // A peer that does not read has fewer places for answers to its calls.
  const bool replies_wait =
      queues.backpressured() &&
      queues.replies.count + state_.calls.open_calls_of(peer) >= replies_max_backpressured;
  if (queues.marked_full || replies_wait) return false;
  const held& of = held_[peer];
  const std::uint32_t left = left_of(slots(), untaken_ + answers_);
  return claims_.may_take(of.untaken + of.answers, left) && has_place();
}

bool receiver::is_absent() const noexcept {
  return !is_there() || (untaken_ != 0 && state_.cycle.waited_since(taken_at_) > receiver_absent_after);
}

admission receiver::admit(peer_index peer) noexcept {
  begin_if_new();
  if (has_share(peer) || ROWE_MUTANT(inbox_share)) return admission::now;
  if (!is_there()) return admission::now;                             // no receiver, no shares
  if (!counted_) state_.threads_inbox.drop_expired(state_.cycle.now); // which releases their slots
  mark_released();
  count_released(0); // unless an earlier submission is still to be taken
  if (has_share(peer)) return admission::now;
  return !is_absent() ? admission::later : admission::never;
}

status receiver::deliver(const detail::value_header& header, std::string_view text) noexcept {
  begin_if_new();
  status done = errc::full;
  if (counted_) {
    json::decoder::diagnosis nothing; // the receiver takes texts
    if (has_place()) done = local_delivery_.deliver(counted_, header, text, nothing);
  } else {
    done = state_.threads_inbox.deliver({.what = header.what,
                                         .peer = header.peer,
                                         .call = header.call,
                                         .stamped = state_.cycle.now,
                                         .expires = rt::time_point{rt::duration{header.expires_ns}}},
                                        text, [this](detail::peer_ref from) { note_taken(from); });
  }
  if (!done) {
    state_.counts.add(done.code() == errc::too_big ? counter::too_big : counter::inbox_full);
    return done;
  }
  if (state_.peers.find({header.peer.index, header.peer.generation}) == nullptr) return done;
  if (untaken_ == 0) taken_at_ = state_.cycle.now;
  claims_.take(held_[{header.peer.index}].untaken);
  ++untaken_;
  return done;
}

// ---- checks

// The totals are the sums over peers. The reserved claims are the parts that peers have not taken.
bool receiver::check() const noexcept {
  held sum;
  std::uint32_t unclaimed = claims_.connections() * claims_.claim();
  for (const peer_index i : state_.peers.ids()) {
    if (state_.peers[i].state == connection::phase::free) continue;
    sum.untaken += held_[i].untaken;
    sum.answers += held_[i].answers;
    unclaimed -= claims_.claim() - claims_.kept_for(held_[i].untaken);
  }
  return sum.untaken == untaken_ && sum.answers == answers_ && unclaimed == claims_.unclaimed();
}

} // namespace rowe::service
