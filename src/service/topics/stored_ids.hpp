// SPDX-License-Identifier: Apache-2.0
// The ids of requests, as they were written, for later reports about them. A short one is stored in its row.
// A longer one takes blocks of a pool, of which each peer has its share (shares.hpp); where that is used up,
// it is not stored. Service thread only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"
#include "service/state/topic_rows.hpp"

namespace rowe::service {

class stored_ids {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<block>(block_count(bounds)) +
           rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
  }
  // `claimants`: how many peers there may be.
  stored_ids(rt::arena& memory, const limits& bounds, std::uint32_t claimants) noexcept
      : blocks_{memory.carve<block>(block_count(bounds))},
        free_{blocks_},
        held_{memory.carve<std::uint32_t>(bounds.connections_max)},
        claims_{block_count(bounds), claimants} {}

  // Replaces what is in `into`.
  void keep(stored_id& into, peer_index of, std::string_view raw) noexcept {
    drop(into, of);
    const auto needed =
        static_cast<std::uint32_t>((raw.size() + id_block_bytes_max - 1) / id_block_bytes_max);
    if (raw.size() > call_id_bytes_max || !claims_.may_take(held_[of], free_.free(), needed)) return;
    claims_.take(held_[of], needed);
    for (std::uint32_t i = needed; i-- > 0;) { // the last one first
      const id_block_id taken = free_.take();
      raw.substr(i * id_block_bytes_max).copy(blocks_[taken].text.data(), id_block_bytes_max);
      blocks_[taken].next = std::exchange(into.first, taken);
    }
    into.bytes = static_cast<std::uint16_t>(raw.size());
  }
  void drop(stored_id& what, peer_index of) noexcept {
    for (id_block_id i = what.first; i;) {
      const id_block_id next = blocks_[i].next;
      free_.give_back(i);
      claims_.give_back(held_[of]);
      i = next;
    }
    what = {};
  }
  // Empty: it was not stored.
  std::string_view read(const stored_id& what, std::span<char, call_id_bytes_max> buffer) const noexcept {
    std::size_t at = 0;
    for (id_block_id i = what.first; i; i = blocks_[i].next) {
      const std::size_t here = std::min(what.bytes - at, id_block_bytes_max);
      std::memcpy(buffer.data() + at, blocks_[i].text.data(), here);
      at += here;
    }
    return {buffer.data(), at};
  }

  std::uint32_t in_use() const noexcept { return free_.in_use(); }
  // The peers hold the blocks that are in use.
  bool check() const noexcept {
    std::uint32_t held = 0;
    for (const peer_index peer : held_.ids()) held += held_[peer];
    return held == in_use() && free_.check([](const block&) { return true; });
  }

 private:
  struct block {
    id_block_id next{}; // of the same id, or in the free list
    std::array<char, id_block_bytes_max> text;
  };
  static constexpr std::uint32_t block_count(const limits& bounds) noexcept {
    return bounds.subscriptions_max / id_blocks_one_in;
  }

  rows<id_block_id, block> blocks_;
  indexed_pool<id_block_id, block, &block::next> free_;
  rows<peer_index, std::uint32_t> held_; // blocks
  claims claims_;
};

} // namespace rowe::service
