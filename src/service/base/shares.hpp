// SPDX-License-Identifier: Apache-2.0
// How much one peer may take of what all peers share: topics, services, subscriptions, calls, latched values,
// the receiver's slots, and slots with messages to one peer. Two rules hold for each of these pools, and a
// third for what belongs to this process.
//
// Each possible connection has a claim to an equal share of one half of the pool. The part that it has not
// taken is reserved for it. So the peer that comes last still finds its claim.
//
// Of the rest, a peer may take no more than it leaves. This is the dynamic threshold with a factor of one
// (Choudhury and Hahne, "Dynamic queue length thresholds for shared-memory packet switches", IEEE/ACM
// Transactions on Networking 6, 1998). Alone, this rule is fair only for what is released soon. If pieces are
// held for long, the first peer takes a half, the second a quarter, and the tenth finds nothing.
//
// A part of each pool belongs to this process and to no peer: places for all its handles, or a quarter.
#pragma once
#include <algorithm>
#include <cassert>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <rowe/limits.hpp>

#include "service/base/service_limits.hpp"

namespace rowe::service {

// The claims to a pool of `pool` pieces. One piece in `one_in` is reserved for claims: 2 reserves a half.
// Each holder has a count of what it holds; all counts begin with 0. If the pool has less than one piece for
// each holder, those that come first get one.
class claims {
 public:
  claims(std::uint32_t pool, std::uint32_t connections, std::uint32_t one_in = 2) noexcept
      : claim_{std::max(pool / one_in / std::max(connections, 1U), 1U)},
        kept_max_{pool / one_in},
        connections_{connections},
        unclaimed_{claim_ * connections} {}

  void take(std::uint32_t& held, std::uint32_t count = 1) noexcept {
    unclaimed_ -= kept_for(held) - kept_for(held + count);
    held += count;
  }
  void give_back(std::uint32_t& held, std::uint32_t count = 1) noexcept {
    assert(held >= count);
    unclaimed_ += kept_for(held - count) - kept_for(held);
    held -= count;
  }

  // Whether a holder of `held` pieces may take `count` more, if `left` are free for peers.
  bool may_take(std::uint32_t held, std::uint32_t left, std::uint32_t count = 1) const noexcept {
    if (count > left) return false;
    return held + count <= claim_ || held + count + kept() <= left - count + 1;
  }
  // How many pieces are reserved for holders that have less than their claim.
  std::uint32_t kept() const noexcept { return std::min(unclaimed_, kept_max_); }
  std::uint32_t claim() const noexcept { return claim_; }
  // How much of their claims all holders have not taken: the sum of kept_for(held).
  std::uint32_t unclaimed() const noexcept { return unclaimed_; }
  std::uint32_t connections() const noexcept { return connections_; }
  std::uint32_t kept_for(std::uint32_t held) const noexcept { return claim_ - std::min(held, claim_); }

 private:
  std::uint32_t claim_;
  std::uint32_t kept_max_;
  std::uint32_t connections_;
  std::uint32_t unclaimed_; // what all are still to take of their claims
};

// The part of a pool that is reserved for what would otherwise find nothing there.
constexpr std::uint32_t reserve_of(std::uint32_t count) noexcept { return count / reserve_one_in; }

// How many of `count` pieces all peers together may have, if this process wants `own` of them. It gets at
// most three quarters.
constexpr std::uint32_t share_of_peers(std::uint32_t count, std::uint32_t own) noexcept {
  const std::uint32_t most = count - reserve_of(count);
  return count - (own < most ? own : most);
}

constexpr std::uint32_t services_of_peers(const limits& bounds) noexcept {
  return share_of_peers(bounds.services_max, bounds.handles_max);
}
constexpr std::uint32_t calls_of_peers(const limits& bounds) noexcept {
  return share_of_peers(bounds.calls_max, reserve_of(bounds.calls_max));
}

// How many of those are free when peers hold `taken`.
constexpr std::uint32_t left_of(std::uint32_t share, std::uint32_t taken) noexcept {
  return share > taken ? share - taken : 0;
}

// What each of `peers` gets of `count` pieces that are divided equally. When slots run out, the peer that
// holds most loses its oldest message. Where queued topic messages hold all slots, that peer holds at least
// this share; where direct messages hold many, it may hold less.
constexpr std::uint32_t equal_share(std::uint32_t count, std::uint32_t peers) noexcept {
  return count / (peers < 1 ? 1 : peers);
}

// How many slots of a size class may be partial at once: a quarter at most. A partial frame cannot be taken
// back, so each of `connections` may hold one by not reading.
constexpr std::uint32_t partial_slots_max(std::uint32_t slots, std::uint32_t connections) noexcept {
  const std::uint32_t quarter = reserve_of(slots);
  return quarter == 0 ? 1 : quarter < connections ? quarter : connections;
}

// Whether a reader that has taken so many bytes of a long value in this time is slow.
constexpr bool is_slow_reader(std::size_t bytes, rt::duration in) noexcept {
  const auto enough =
      std::chrono::milliseconds{static_cast<std::int64_t>(bytes) * 1000 / slow_reader_bytes_per_second};
  return in > slow_reader_time_min && in > enough;
}

// How many slots of a size class direct messages may have; they hold a slot until they are sent. A quarter is
// for other messages, besides the slots that may be partial.
constexpr std::uint32_t message_slots_max(std::uint32_t slots, std::uint32_t connections) noexcept {
  const std::uint32_t others = reserve_of(slots) + partial_slots_max(slots, connections);
  return slots > others ? slots - others : 1;
}

} // namespace rowe::service
