// SPDX-License-Identifier: Apache-2.0
// The receiver of what no other handle takes: plain messages, and calls of services that nobody provides.
// Among the handles that receive it is the one that was attached first; if there is none, the shared inbox.
//
// The receiver has a number of slots, and each peer has a share of them (shares.hpp). A quarter is reserved
// for claims; that is enough, since a receiver releases slots all the time. A peer is charged for its
// messages until the receiver releases them, and for answers that are parked on the way to it. So a receiver
// that answers each message with one message finds room for the answer.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/shares.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

// Whether the receiver takes a message of a peer.
enum class admission : std::uint8_t { now, later, never };

struct receiver_needs {
  core_state& state_;
  const outbox& outbox_;
  local_delivery& local_delivery_;
};

class receiver : receiver_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<held>(bounds.connections_max);
  }
  receiver(rt::arena& memory, const receiver_needs& parts) noexcept;

  // The handle that is the receiver; none: it is the shared inbox.
  pair_index pair() const noexcept { return pair_; }
  // Whether somebody receives calls that no handle serves.
  bool is_there() const noexcept;
  // A handle was attached, or is being detached.
  void attach() noexcept { pair_ = first_but({}); }
  void detach(pair_index pair) noexcept;
  // A peer leaves: no share is charged for its messages any more.
  void forget(peer_index peer) noexcept;

  // `later`: there is no room now. `never`: there is no room, and the receiver is absent.
  admission admit(peer_index peer) noexcept;
  // Errors: full, too_big, counted.
  status deliver(const detail::value_header& header, std::string_view text) noexcept;

  // ---- released slots

  // A receiver submits its answer, and then releases the message's slot. The peer stays charged for that slot
  // until the submissions before the release were taken. Then it is charged for the answer, if this is
  // parked.
  //
  // mark_released() records which slots are released. Then the receiver's submissions are taken. Then
  // count_released() counts the slots up to the mark; `taken`: how many submissions those were.
  void mark_released() noexcept;
  void count_released(std::size_t taken) noexcept;
  // Counts released slots now. A handle wakes nobody when it releases a slot. The shared inbox wakes the
  // service thread at the next release.
  void look() noexcept;
  // Raised when released slots may have to be looked at once more.
  std::uint64_t looks_wanted() const noexcept { return looks_wanted_; }

  // The receiver's parked answers are counted anew in each of its turns.
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
    std::uint32_t untaken = 0; // messages that it sent and the receiver still has
    std::uint32_t answers = 0; // answers to it, parked in the receiver's last turn
  };
  static constexpr pair_index unknown{UINT32_MAX - 1};

  pair_index first_but(pair_index but) const noexcept;
  void begin_if_new() noexcept {
    if (pair_ != counted_) begin();
  }
  void begin() noexcept;
  void forget_answers() noexcept;
  void note_taken(detail::peer_ref from) noexcept;
  std::uint32_t slots() const noexcept;
  bool has_place() const noexcept {
    return !counted_ ? state_.threads_inbox.free_slots() != 0
                     : state_.pairs[counted_].service.in.free_ring->seen_by_owner() != 0;
  }
  bool has_share(peer_index peer) const noexcept;
  bool is_absent() const noexcept;

  pair_index pair_{};    // the receiver; none: the shared inbox
  pair_index counted_{}; // the receiver that the counts are of
  rows<peer_index, held> held_;
  claims claims_;                   // for the counts of untaken messages
  std::uint32_t untaken_ = 0;       // of all peers
  std::uint32_t answers_ = 0;       // of all peers, too
  rt::time_point taken_at_{};       // when a message was taken last, or the first began to wait
  std::uint64_t released_mark_ = 0; // a handle: slots released up to here are counted next,
  std::uint64_t before_mark_ = 0;   // after so many more submissions were taken
  bool marked_ = false;
  std::uint64_t looks_wanted_ = 0;
};

} // namespace rowe::service
