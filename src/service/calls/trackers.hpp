// SPDX-License-Identifier: Apache-2.0
// Trackers of direct messages and of requests of calls. A direct message lies in a wire slot, like everything
// that is written, and its tracker is found by the slot's number. A tracked message holds its slot while it
// is under way, so its sender can get the outcome: `sent` when the whole message was written to one peer,
// otherwise why it was not. A message that finds no peer, or whose peers all left before it was written, is
// pending until a peer comes or it expires. Pending trackers form a doubly linked list, so taking one out of
// the middle costs the same in a long list. Service thread only.
#pragma once
#include <array>
#include <cassert>
#include <cstdint>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/index_list.hpp"
#include "service/base/shares.hpp"
#include "service/base/slot_pool.hpp"
#include "service/state/call_table.hpp"

namespace rowe::service {

struct tracker {
  enum class state : std::uint8_t { none, queued, pending };
  state now = state::none;
  rowe::priority priority = rowe::priority::normal;
  bool everyone = false; // else to one peer; if that leaves, the message is lost
  bool sent = false;
  bool counted = false;          // trackers::begin() counted it
  bool is_long = false;          // the call gets its outcome
  peer_index charged{};          // the peer whose share of the slots it is
  call_endpoint sender{};        // who gets the outcome; or nobody
  detail::call_ref own{};        // if that is a handle: its own name for it
  detail::call_ref request_of{}; // the call whose request this is, or whose long answer
  slot_id previous{};            // in the list of pending ones
  slot_id next{};
};

class trackers {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<tracker>(slot_pool::count(bounds)) +
           2 * rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
  }
  // `connections`: how many there may be; each has a claim to slots.
  trackers(rt::arena& memory, const limits& bounds, std::uint32_t connections) noexcept
      : rows_{memory.carve<tracker>(slot_pool::count(bounds))},
        first_large_{slot_pool::first_large(bounds)},
        slots_max_{message_slots_max(bounds.small_slots, bounds.connections_max),
                   message_slots_max(bounds.large_slots, bounds.connections_max)},
        claims_{claims{slots_max_[0], connections}, claims{slots_max_[1], connections}},
        held_{memory.carve<std::uint32_t>(bounds.connections_max),
              memory.carve<std::uint32_t>(bounds.connections_max)} {}

  // Begins to track a message in a slot of its own.
  void begin(slot_id slot, const tracker& as) noexcept {
    rows_[slot] = as;
    rows_[slot].now = tracker::state::queued;
    rows_[slot].counted = true;
    ++tracked_[slot.value >= first_large_];
  }
  // How many more slots of a class may be tracked. Some slots are never for tracked messages, since these
  // hold theirs until they are sent.
  std::uint32_t slots_left(slot_class of) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    return left_of(slots_max_[which], tracked_[which]);
  }
  // Whether there is one beyond those that peers have claims to.
  bool any_unclaimed(slot_class of) const noexcept {
    const std::uint32_t kept = ROWE_MUTANT(pending_claims) ? 0 : claims_[static_cast<std::size_t>(of)].kept();
    return slots_left(of) > kept;
  }
  // Whether a peer may have one more slot for messages to it alone. Beyond its claim, a backpressured peer
  // leaves one half of the slots to the others, which release theirs soon.
  bool has_share(peer_index peer, bool backpressured, slot_class of) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    const std::uint32_t held = held_[which][peer];
    if (!backpressured || held < claims_[which].claim()) return claims_[which].may_take(held, slots_left(of));
    return held + 1 + slots_max_[which] / 2 <= slots_left(of); // the half includes what claims reserve
  }
  // Whether backpressured peers may have one more message to everyone. Each holds its slot until the slowest
  // peer has it, and peers that came one after the other hold different ones. So all backpressured peers
  // together leave one half of the slots to the others. `own`: how many slots the message has already.
  bool may_share(slot_class of, std::uint32_t own) const noexcept {
    return slots_left(of) + own > slots_max_[static_cast<std::size_t>(of)] / 2;
  }
  // Charges a peer for a message that goes to it alone.
  void charge(slot_id slot, peer_index peer) noexcept {
    const std::size_t which = slot.value >= first_large_;
    rows_[slot].charged = peer;
    claims_[which].take(held_[which][peer]);
  }

  tracker& at(slot_id slot) noexcept { return rows_[slot]; }
  bool under_way(slot_id slot) const noexcept { return rows_[slot].now != tracker::state::none; }

  void wait(slot_id slot) noexcept {
    tracker& it = rows_[slot];
    assert(it.now == tracker::state::queued);
    it.now = tracker::state::pending;
    pending_.push_back(rows_, slot);
    ++began_to_wait_;
  }
  // It is not pending any more, if it was.
  void end_pending(slot_id slot) noexcept {
    tracker& it = rows_[slot];
    if (it.now != tracker::state::pending) return;
    pending_.erase(rows_, slot);
    it.now = tracker::state::queued;
  }
  void forget(slot_id slot) noexcept {
    end_pending(slot);
    const std::size_t which = slot.value >= first_large_;
    tracked_[which] -= rows_[slot].counted;
    if (rows_[slot].charged) claims_[which].give_back(held_[which][rows_[slot].charged]);
    rows_[slot] = {};
  }

  slot_id first_pending() const noexcept { return pending_.head; }
  std::uint32_t pending() const noexcept { return pending_.count; }
  std::uint64_t began_to_wait() const noexcept { return began_to_wait_; } // so far

  bool check() const noexcept {
    return pending_.check(rows_, [](const tracker& it) { return it.now == tracker::state::pending; }) &&
           check_shares();
  }

 private:
  // Each peer is charged for the slots that it holds; the rest of the claims is reserved.
  bool check_shares() const noexcept {
    for (std::size_t which = 0; which != claims_.size(); ++which) {
      std::uint32_t charged = 0;
      for (const slot_id slot : rows_.ids())
        charged += rows_[slot].charged && (slot.value >= first_large_) == (which == 1);
      std::uint32_t unclaimed = claims_[which].connections() * claims_[which].claim();
      for (const std::uint32_t held : held_[which]) {
        charged -= held;
        unclaimed -= claims_[which].claim() - claims_[which].kept_for(held);
      }
      if (charged != 0 || unclaimed != claims_[which].unclaimed()) return false;
    }
    return true;
  }

  rows<slot_id, tracker> rows_;
  const std::uint32_t first_large_;
  const std::array<std::uint32_t, 2> slots_max_;
  std::array<claims, 2> claims_;
  std::array<rows<peer_index, std::uint32_t>, 2> held_; // by peer
  std::array<std::uint32_t, 2> tracked_{};
  index_list<slot_id, tracker, &tracker::next, &tracker::previous> pending_;
  std::uint64_t began_to_wait_ = 0;
};

} // namespace rowe::service
