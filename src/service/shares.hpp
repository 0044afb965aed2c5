// SPDX-License-Identifier: Apache-2.0
// How much one peer may take of what all peers share: topics, services, subscriptions, calls, latched values,
// slots for direct messages. One rule for all of them: nobody takes more than they leave. So N peers that
// take whatever they get leave a share of 1 / (N + 1) to the next one, however many they are, and one peer
// alone may have half. It is the dynamic threshold with a factor of one (Choudhury and Hahne, "Dynamic queue
// length thresholds for shared-memory packet switches", IEEE/ACM Transactions on Networking 6, 1998).
//
// A part of each pool is this process's own, and no peer's: places for all its handles, or a quarter.
#pragma once
#include <cstdint>

namespace rowe::service {

// Whether one who holds `held` may take one more where `left` are free for peers.
constexpr bool may_take(std::uint32_t held, std::uint32_t left) noexcept { return held < left; }

// How many of a pool of `count` peers may have together where this process wants `own` of them; it gets three
// quarters at most.
constexpr std::uint32_t share_of_peers(std::uint32_t count, std::uint32_t own) noexcept {
  const std::uint32_t most = count - count / 4;
  return count - (own < most ? own : most);
}

// How many of those are free when peers hold `taken`.
constexpr std::uint32_t left_of(std::uint32_t share, std::uint32_t taken) noexcept {
  return share > taken ? share - taken : 0;
}

// How many slots of a size class may be in the hands of sockets at once, each with a part of its frame out:
// such a one cannot be taken back, and of `connections` that do not read each may keep one.
constexpr std::uint32_t begun_slots_max(std::uint32_t slots, std::uint32_t connections) noexcept {
  const std::uint32_t quarter = slots / 4;
  return quarter == 0 ? 1 : quarter < connections ? quarter : connections;
}

// How many of them direct messages may have, which are kept until they are sent. A quarter is for the rest,
// beyond what sockets may have.
constexpr std::uint32_t message_slots_max(std::uint32_t slots, std::uint32_t connections) noexcept {
  const std::uint32_t others = slots / 4 + begun_slots_max(slots, connections);
  return slots > others ? slots - others : 1;
}

} // namespace rowe::service
