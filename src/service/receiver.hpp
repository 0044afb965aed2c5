// SPDX-License-Identifier: Apache-2.0
// Who receives what no other handle takes: plain messages, and calls of services that nobody provides. It is
// the handle that receives and was attached first, or else the shared inbox of the front door.
//
// Whoever receives has so many slots, of which a peer may have its share (shares.hpp): a quarter is kept for
// claims, for who receives gives slots back all the time. A peer's are those of its messages that were not
// taken or are still in the receiver's hands, and those of answers that are parked on the way to it. So who
// answers each message with one finds room for the answer.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/lane.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/front_door.hpp"
#include "service/local_delivery.hpp"
#include "service/outbox.hpp"
#include "service/pair_table.hpp"
#include "service/peer_table.hpp"
#include "service/shares.hpp"

namespace rowe::service {

// Whether a message of a peer may go to whoever receives.
enum class admission : std::uint8_t { now, later, never };

class receiver {
 public:
  struct needs {
    cycle_state& cycle;
    counters& counts;
    peer_table& peers;
    const outbox& out;
    std::span<detail::lane> lanes;
    std::span<lane_view> views;
    front_door& door;
    local_delivery& delivery;
    std::uint32_t claimants; // how many connections there may be, each with its claim
    bool answers_any;        // somebody answers calls, although nobody has asked for any yet
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<held>(bounds.connections_max);
  }
  receiver(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  // The handle that receives; no_index: the shared inbox.
  std::uint32_t pair() const noexcept { return pair_; }
  // Whether somebody waits for calls that no handle serves.
  bool is_there() const noexcept;
  // A handle has come, or goes.
  void attach() noexcept { pair_ = first_but(no_index); }
  void detach(std::uint32_t pair) noexcept;
  // A peer goes: what it sent is nobody's share any more.
  void forget(peer_index peer) noexcept;

  // `later`: there is no room, and whoever receives is at work. `never`: it does not take anything.
  admission admit(peer_index peer) noexcept;
  // Errors: full, too_big, counted.
  status deliver(const detail::value_header& header, std::string_view text) noexcept;

  // ---- what came home

  // Whoever answers a message does so before its slot goes home: such a slot counts until all that was handed
  // over before it came home has been taken, and is counted where it is parked. So the submissions of whoever
  // receives are taken between these two; `taken`: how many that were.
  void mark_home() noexcept;
  void count_home(std::size_t taken) noexcept;
  // For those who wait for room. A handle does not tell what it takes; the shared inbox does, from here on.
  void look() noexcept;
  // Raised where what came home may have to be looked at once more.
  std::uint64_t looks_wanted() const noexcept { return looks_wanted_; }

  // Answers of whoever receives that are parked: counted anew in each of its turns.
  void begin_answers() noexcept {
    if (answers_ != 0) forget_answers();
  }
  void count_answer(peer_index to) noexcept {
    ++held_[to].answers;
    ++answers_;
  }

  bool check() const noexcept;

 private:
  // Of one peer.
  struct held {
    std::uint32_t untaken = 0; // messages
    std::uint32_t answers = 0; // parked, in the last turn of whoever receives
  };
  static constexpr std::uint32_t unknown = no_index - 1;

  std::uint32_t first_but(std::uint32_t but) const noexcept;
  void begin_if_new() noexcept {
    if (pair_ != counted_) begin();
  }
  void begin() noexcept;
  void forget_answers() noexcept;
  void note_taken(detail::peer_ref from) noexcept;
  std::uint32_t slots() const noexcept;
  bool has_place() const noexcept {
    return counted_ == no_index ? door_.free_inbound() != 0
                                : lanes_[counted_].service.in.home->seen_by_owner() != 0;
  }
  bool has_share(peer_index peer) const noexcept;
  bool is_absent() const noexcept;

  cycle_state& cycle_;
  counters& counts_;
  peer_table& peers_;
  const outbox& out_;
  std::span<detail::lane> lanes_;
  std::span<lane_view> views_;
  front_door& door_;
  local_delivery& delivery_;
  const std::uint32_t claimants_;
  const bool answers_any_;

  std::uint32_t pair_ = no_index;    // that receives; none: the shared inbox
  std::uint32_t counted_ = no_index; // that the counts are of
  rows<peer_index, held> held_;
  claims claims_;                 // by what was not taken
  std::uint32_t untaken_ = 0;     // of all peers
  std::uint32_t answers_ = 0;     // likewise
  rt::time_point taken_at_{};     // when one was taken last, or the first began to wait
  std::uint64_t home_mark_ = 0;   // of a handle: what is home up to here is counted next,
  std::uint64_t before_mark_ = 0; // when so many more submissions were taken
  bool marked_ = false;
  std::uint64_t looks_wanted_ = 0;
};

} // namespace rowe::service
