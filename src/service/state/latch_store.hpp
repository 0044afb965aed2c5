// SPDX-License-Identifier: Apache-2.0
// The last values of latched topics, for late subscribers. Only the body of the message is retained, in
// blocks of a pool of its own. So values that stay for hours take no slot from messages on their way. A long
// value stays in its chunks: peers may have a quarter of all chunks with such values, and this process
// another one. Service thread only; nothing here waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/chunk_store.hpp"
#include "service/base/index_list.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"

namespace rowe::json {
class writer;
}

namespace rowe::service {

// Who published the value; it goes when its publisher goes.
struct latch_owner {
  enum class kind : std::uint8_t { nobody, handle, peer };
  kind who = kind::nobody;
  std::uint32_t index = 0; // of the queue pair, or the peer
  friend bool operator==(const latch_owner&, const latch_owner&) = default;
};

struct latch_block {
  block_id next{};
  std::array<char, latch_block_bytes_max> text;
};

struct latched_value {
  index_queue<block_id, latch_block, &latch_block::next> text;
  text_id chunks{}; // of a long value: in place of that
  std::uint32_t bytes = 0;
  std::uint32_t blocks = 0; // or chunks
  latch_owner owner{};
  rt::time_point expires = rt::never;
  rt::time_point published{};

  bool empty() const noexcept { return text.empty() && !chunks; }
};

class latch_store {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // `chunks`: where long values are.
  latch_store(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept;

  // Replaces the value in `into` by `body`. False if there is no room, or if the owner may not hold so much.
  // Then `into` is empty. shares.hpp says how much a peer may hold; half of the pool belongs to this process.
  bool store(latched_value& into, std::string_view body, latch_owner owner, rt::time_point expires) noexcept;
  // The same for a long value, to which `into` holds a reference.
  bool store_long(latched_value& into, text_id value, latch_owner owner, rt::time_point expires) noexcept;
  void clear(latched_value& what) noexcept;
  void write(const latched_value& what, json::writer& into) const noexcept;

  std::uint32_t blocks() const noexcept { return blocks_.size(); }
  std::uint32_t in_use() const noexcept { return free_.in_use(); }
  std::uint32_t held_by(peer_index peer) const noexcept { return held_[peer]; }
  // Chunks of long values.
  std::uint32_t chunks_in_use() const noexcept { return long_of_peers_ + long_of_handles_; }
  std::uint32_t chunks_held_by(peer_index peer) const noexcept { return long_held_[peer]; }

 private:
  static std::size_t block_count(const limits& bounds) noexcept {
    return bounds.latched_bytes / sizeof(latch_block);
  }

  chunk_store& chunks_;
  rows<block_id, latch_block> blocks_;
  indexed_pool<block_id, latch_block, &latch_block::next> free_;
  rows<peer_index, std::uint32_t> held_; // blocks
  claims claims_;
  std::uint32_t of_peers_ = 0;
  rows<peer_index, std::uint32_t> long_held_; // chunks
  std::uint32_t long_of_peers_ = 0;
  std::uint32_t long_of_handles_ = 0;
};

} // namespace rowe::service
