// SPDX-License-Identifier: Apache-2.0
#include "service/receiver.hpp"

#include <algorithm>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {
namespace {

// After this time without a take, a receiver is absent: messages that find no room are dropped.
constexpr rt::duration absent_after = std::chrono::seconds{8};
constexpr std::uint32_t one_in = 4; // kept for claims

} // namespace

receiver::receiver(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : cycle_{parts.cycle},
      counts_{parts.counts},
      peers_{parts.peers},
      calls_{parts.calls},
      out_{parts.out},
      lanes_{parts.lanes},
      views_{parts.views},
      queue_{parts.queue},
      shared_{parts.shared},
      delivery_{parts.delivery},
      claimants_{parts.claimants},
      answers_any_{parts.answers_any},
      held_{memory.carve<held>(bounds.connections_max)},
      claims_{parts.shared.slots(), parts.claimants, one_in} {}

// ---- who it is

pair_index receiver::first_but(pair_index but) const noexcept {
  pair_index first{};
  for (const pair_index i : lanes_.ids()) {
    if (i == but || !views_[i].attached || lanes_[i].kind != detail::lane_kind::talk || !lanes_[i].receives)
      continue;
    if (!first || views_[i].order < views_[first].order) first = i;
  }
  return first;
}

void receiver::detach(pair_index pair) noexcept {
  pair_ = first_but(pair);
  if (counted_ == pair) counted_ = unknown;
}

bool receiver::is_there() const noexcept { return pair_ || answers_any_ || shared_.has_receiver(); }

// The counts begin again for a new receiver, which has no message yet. What the old one still has is not
// counted.
void receiver::begin() noexcept {
  counted_ = pair_;
  for (held& one : held_) one = {};
  untaken_ = answers_ = 0;
  claims_ = claims{slots(), claimants_, one_in};
  marked_ = false;
  shared_.forget_senders();
  taken_at_ = cycle_.now;
  ++cycle_.places_freed;
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
  taken_at_ = cycle_.now;
  ++cycle_.places_freed;
  if (peers_.find({from.index, from.generation}) == nullptr) return;
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
    shared_.mark();
    before_mark_ = queue_.submitted();
  } else {
    released_mark_ = lanes_[counted_].service.in.free_ring->mark_home();
    before_mark_ = lanes_[counted_].service.out.out->waiting_at_least();
  }
}

void receiver::count_released(std::size_t taken) noexcept {
  before_mark_ -= std::min<std::uint64_t>(before_mark_, taken);
  if (before_mark_ != 0) return;
  marked_ = false;
  // Slots that were released after the mark are found with the next mark.
  if (taken != 0) ++looks_wanted_;
  if (!counted_) {
    (void)shared_.collect_marked([this](detail::peer_ref from) { note_taken(from); });
    return;
  }
  const detail::producer_end& path = lanes_[counted_].service.in;
  path.free_ring->see(released_mark_, [&](std::uint32_t slot) { note_taken(path.slots.header(slot)->peer); });
}

void receiver::look() noexcept {
  begin_if_new();
  if (!counted_) shared_.ask_for_slots(); // a slot released before is found below
  mark_released();
  count_released(0);
}

// ---- shares

// The slots of the inbox, or of the queue for answers if these are fewer.
inline std::uint32_t receiver::slots() const noexcept {
  if (!counted_) return shared_.slots();
  const detail::lane& by = lanes_[counted_];
  return std::min(by.service.in.count, by.user.out.count);
}

inline bool receiver::has_share(peer_index peer) const noexcept {
  const peer_queues& queues = out_.of(peer);
  // Answers to its calls have fewer places while the peer does not read.
  const bool replies_wait =
      queues.backpressured() && queues.replies.count + calls_.asked_by(peer) >= replies_max_backpressured;
  if (queues.told_full || replies_wait) return false;
  const held& of = held_[peer];
  const std::uint32_t left = left_of(slots(), untaken_ + answers_);
  return claims_.may_take(of.untaken + of.answers, left) && has_place();
}

bool receiver::is_absent() const noexcept {
  return !is_there() || (untaken_ != 0 && cycle_.now - taken_at_ > absent_after);
}

admission receiver::admit(peer_index peer) noexcept {
  begin_if_new();
  if (has_share(peer) || ROWE_MUTANT(inbox_share)) return admission::now;
  if (!is_there()) return admission::now;          // no receiver, no shares
  if (!counted_) shared_.drop_expired(cycle_.now); // which releases their slots
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
    if (has_place()) done = delivery_.deliver(counted_, header, text, nothing);
  } else {
    done = shared_.deliver({.what = header.what,
                            .peer = header.peer,
                            .call = header.call,
                            .stamped = cycle_.now,
                            .expires = rt::time_point{rt::duration{header.expires_ns}}},
                           text, [this](detail::peer_ref from) { note_taken(from); });
  }
  if (!done) {
    counts_.add(done.code() == errc::too_big ? counter::too_big : counter::inbox_full);
    return done;
  }
  if (peers_.find({header.peer.index, header.peer.generation}) == nullptr) return done;
  if (untaken_ == 0) taken_at_ = cycle_.now;
  claims_.take(held_[{header.peer.index}].untaken);
  ++untaken_;
  return done;
}

// ---- for tests

// The totals are the sums over peers, and the kept claims are what peers have not taken.
bool receiver::check() const noexcept {
  held sum;
  std::uint32_t wanted = claims_.connections() * claims_.claim();
  for (const peer_index i : peers_.ids()) {
    if (peers_[i].state == connection::phase::free) continue;
    sum.untaken += held_[i].untaken;
    sum.answers += held_[i].answers;
    wanted -= claims_.claim() - claims_.kept_for(held_[i].untaken);
  }
  return sum.untaken == untaken_ && sum.answers == answers_ && wanted == claims_.wanted();
}

} // namespace rowe::service
