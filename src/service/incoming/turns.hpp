// SPDX-License-Identifier: Apache-2.0
// Whose turn it is to be read, where several peers have sent something. They take turns in rounds.
//
// A peer's share is one of work, not of messages (deficit round robin: Shreedhar and Varghese, "Efficient
// fair queueing using deficit round-robin", 1995). A turn is one message, and the whole of it, however much
// work it takes. Then its peer sits out as many rounds as that was turns. Who has had nothing to say, and
// sits out no rounds, comes before the round (as new flows do in FQ-CoDel, RFC 8290).
//
// Service thread only; nothing waits or allocates. A step each, but for next(): it passes over those that sit
// out this round, each of them once.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/index_ring.hpp"
#include "service/base/work.hpp"

namespace rowe::service {

class turns {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint64_t>(bounds.connections_max) +
           2 * rt::arena::bytes_for<peer_index>(bounds.connections_max);
  }
  turns(rt::arena& memory, const limits& bounds) noexcept
      : due_{memory.carve<std::uint64_t>(bounds.connections_max)},
        fresh_{memory.carve<peer_index>(bounds.connections_max)},
        waiting_{memory.carve<peer_index>(bounds.connections_max)} {}

  // A new peer has this index.
  void open(peer_index peer) noexcept { due_[peer] = 0; }

  bool empty() const noexcept { return count_ == 0; }
  std::uint32_t count() const noexcept { return count_; }

  // The peer, which does not wait yet, has something to be read.
  void push(peer_index peer) noexcept {
    ++count_;
    due_[peer] <= round_ ? fresh_.push(peer) : stand_behind(peer);
  }
  // Whose turn it is; it does not wait any more. There is one. Rounds in which nobody is due are left out.
  peer_index next() noexcept {
    --count_;
    if (!fresh_.empty()) return fresh_.pop();
    for (;;) {
      if (left_ == 0) {
        round_ = std::exchange(next_round_, UINT64_MAX);
        left_ = waiting_.count();
      }
      --left_;
      const peer_index peer = waiting_.pop();
      if (due_[peer] <= round_) return peer;
      stand_behind(peer);
    }
  }
  // The peer has had its turn, which took so much work.
  void charge(peer_index peer, std::size_t work) noexcept {
    due_[peer] = round_ + (ROWE_MUTANT(turn_share) ? 1 : std::max<std::size_t>(1, work / turn_work));
    last_due_ = std::max(last_due_, due_[peer]);
  }
  // If nobody waits now, nobody sits out anything.
  void end() noexcept {
    if (empty()) round_ = last_due_;
  }

  bool check() const noexcept {
    return left_ <= waiting_.count() && count_ == waiting_.count() + fresh_.count();
  }

 private:
  void stand_behind(peer_index peer) noexcept {
    waiting_.push(peer);
    next_round_ = std::min(next_round_, std::max(due_[peer], round_ + 1));
  }

  rows<peer_index, std::uint64_t> due_; // not before that round
  index_ring<peer_index> fresh_;
  index_ring<peer_index> waiting_;
  std::uint32_t count_ = 0; // in both
  std::uint64_t round_ = 0;
  std::uint64_t next_round_ = UINT64_MAX; // the first in which one that waits is due
  std::uint64_t last_due_ = 0;            // the last that anybody waits, or has waited, for
  std::uint32_t left_ = 0;                // of waiting_, from its front: in this round
};

} // namespace rowe::service
