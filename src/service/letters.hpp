// SPDX-License-Identifier: Apache-2.0
// Messages that are not of a topic: to one connection or to everyone who takes them, and the requests of
// calls. A letter lies in a wire slot like everything that is written. While it is under way it
// keeps that slot, so that its sender can be told what became of it: `sent` as soon as one peer was given all
// of it, else why not. One that finds no peer, or loses all it had before they were given it, waits
// in the waiting room until one comes or its time is over: a list through the letters themselves, so that
// taking one out of the middle costs as little as out of a short one. Service thread only.
#pragma once
#include <array>
#include <cassert>
#include <cstdint>
#include <span>

#include <rowe/detail/lane.hpp>
#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>

#include "service/calls.hpp"
#include "service/index_list.hpp"
#include "service/shares.hpp"
#include "service/wire_slots.hpp"

namespace rowe::service {

struct letter {
  enum class state : std::uint8_t { none, queued, waiting };
  state now = state::none;
  rowe::priority priority = rowe::priority::normal;
  bool everyone = false; // else to one connection, with which it is lost
  bool sent = false;
  bool counted = false;             // begun with letters::begin()
  std::uint32_t charged = no_index; // the connection whose share of the slots it is
  party sender{};                   // who wants to know; nobody
  detail::call_ref own{};           // and by which place of its own table, if it is a lane
  detail::call_ref request_of{};    // the call whose request this is
  slot_id previous{};               // among those that wait
  slot_id next{};
};

class letters {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<letter>(wire_slots::count(bounds)) +
           2 * rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
  }
  // `connections`: how many there may be, each of which has a claim to slots.
  letters(rt::arena& memory, const limits& bounds, std::uint32_t connections) noexcept
      : letters_{memory.carve<letter>(wire_slots::count(bounds))},
        first_large_{wire_slots::first_large(bounds)},
        slots_max_{message_slots_max(bounds.small_slots, bounds.connections_max),
                   message_slots_max(bounds.large_slots, bounds.connections_max)},
        claims_{claims{slots_max_[0], connections}, claims{slots_max_[1], connections}},
        held_{memory.carve<std::uint32_t>(bounds.connections_max),
              memory.carve<std::uint32_t>(bounds.connections_max)} {}

  // One that was composed for this, in its own slot.
  void begin(std::uint32_t slot, const letter& as) noexcept {
    letters_[slot_id{slot}] = as;
    letters_[slot_id{slot}].now = letter::state::queued;
    letters_[slot_id{slot}].counted = true;
    ++begun_[slot >= first_large_];
  }
  // How many slots of a class there may still be for those. Some are never theirs, since they are kept until
  // they are sent.
  std::uint32_t slots_left(slot_class of) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    return left_of(slots_max_[which], begun_[which]);
  }
  // Whether a connection may have one more, in a slot that nobody else waits for. Who is behind takes nothing
  // of one half beyond its claim: those who are not give their slots back at once.
  bool has_share(std::uint32_t connection, bool behind, slot_class of) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    const std::uint32_t held = held_[which][connection];
    if (!behind || held < claims_[which].claim()) return claims_[which].may_take(held, slots_left(of));
    return held + 1 + slots_max_[which] / 2 <= slots_left(of); // what is kept for claims is part of that half
  }
  // One that is to go to a connection alone.
  void charge(std::uint32_t slot, std::uint32_t connection) noexcept {
    const std::size_t which = slot >= first_large_;
    letters_[slot_id{slot}].charged = connection;
    claims_[which].take(held_[which][connection]);
  }

  letter& at(std::uint32_t slot) noexcept { return letters_[slot_id{slot}]; }
  bool under_way(std::uint32_t slot) const noexcept {
    return letters_[slot_id{slot}].now != letter::state::none;
  }

  void wait(std::uint32_t slot) noexcept {
    letter& l = letters_[slot_id{slot}];
    assert(l.now == letter::state::queued);
    l.now = letter::state::waiting;
    waiting_.push_back(letters_, slot_id{slot});
    ++began_to_wait_;
  }
  // Out of the waiting room, if it is there.
  void stop_waiting(std::uint32_t slot) noexcept {
    letter& l = letters_[slot_id{slot}];
    if (l.now != letter::state::waiting) return;
    waiting_.erase(letters_, slot_id{slot});
    l.now = letter::state::queued;
  }
  void forget(std::uint32_t slot) noexcept {
    stop_waiting(slot);
    const std::size_t which = slot >= first_large_;
    begun_[which] -= letters_[slot_id{slot}].counted;
    if (letters_[slot_id{slot}].charged != no_index)
      claims_[which].give_back(held_[which][letters_[slot_id{slot}].charged]);
    letters_[slot_id{slot}] = {};
  }

  std::uint32_t first_waiting() const noexcept { return waiting_.head.value; }
  std::uint32_t waiting() const noexcept { return waiting_.count; }
  std::uint64_t began_to_wait() const noexcept { return began_to_wait_; } // so far

  bool check() const noexcept {
    return waiting_.check(letters_, [](const letter& l) { return l.now == letter::state::waiting; }) &&
           check_shares();
  }

 private:
  // What connections are charged for is what is there, and of the claims the rest is kept.
  bool check_shares() const noexcept {
    for (std::size_t which = 0; which != claims_.size(); ++which) {
      std::uint32_t charged = 0;
      for (std::uint32_t slot = 0; slot != letters_.size(); ++slot)
        charged += letters_[slot_id{slot}].charged != no_index && (slot >= first_large_) == (which == 1);
      std::uint32_t wanted = claims_[which].connections() * claims_[which].claim();
      for (const std::uint32_t held : held_[which]) {
        charged -= held;
        wanted -= claims_[which].claim() - claims_[which].kept_for(held);
      }
      if (charged != 0 || wanted != claims_[which].wanted()) return false;
    }
    return true;
  }

  rows<slot_id, letter> letters_;
  const std::uint32_t first_large_;
  const std::array<std::uint32_t, 2> slots_max_;
  std::array<claims, 2> claims_;
  std::array<std::span<std::uint32_t>, 2> held_; // by connection
  std::array<std::uint32_t, 2> begun_{};
  index_list<slot_id, letter, &letter::next, &letter::previous> waiting_;
  std::uint64_t began_to_wait_ = 0;
};

} // namespace rowe::service
