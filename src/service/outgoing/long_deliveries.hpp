// SPDX-License-Identifier: Apache-2.0
// Copies long values into the inboxes of handles, some of each in a cycle: a handle reads contiguous memory,
// and one copy of tens of megabytes would hold up everything else. Until a handle has its long value, it is
// given no other one, so values do not overtake each other; those are counted as inbox_full.
//
// Service thread only; nothing waits or allocates. A user thread that sleeps is woken, which enters the
// kernel.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/index_ring.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct long_deliveries_needs {
  core_state& state_;
  local_delivery& local_delivery_;
};

class long_deliveries : long_deliveries_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<delivery>(bounds.handles_max) +
           rt::arena::bytes_for<pair_index>(bounds.handles_max);
  }
  long_deliveries(rt::arena& memory, const long_deliveries_needs& parts) noexcept
      : long_deliveries_needs{parts},
        rows_{memory.carve<delivery>(state_.bounds().handles_max)},
        turns_{memory.carve<pair_index>(state_.bounds().handles_max)} {}

  // Begins to deliver a value. Errors: full; too_big, also where the handle reads structs.
  status begin(pair_index pair, const detail::value_header& header, text_id value) noexcept {
    const detail::queue_pair& queues = state_.pairs[pair];
    const std::size_t bytes = state_.chunks.bytes(value);
    const std::size_t most =
        queues.decoder != nullptr ? state_.bounds().message_bytes_max : queues.service.in.memory.bytes_max;
    if (bytes > most || queues.decoder != nullptr)
      return error{errc::too_big, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(most)};
    if (!local_delivery_.may_deliver(pair, header.peer)) return errc::full;
    const auto slot = local_delivery_.take_slot(pair);
    if (!slot) return errc::full;
    delivery& begun = rows_[pair];
    if (begun.value) end(pair); // of a handle that is gone
    begun.value = value;
    begun.generation = state_.pair_rows[pair].generation;
    begun.slot = *slot;
    begun.done = 0;
    begun.place = {};
    begun.header = header;
    begun.header.bytes = static_cast<std::uint32_t>(bytes);
    state_.chunks.retain(value);
    state_.pair_rows[pair].busy = true;
    if (!std::exchange(begun.in_turns, true)) turns_.push(pair);
    return {};
  }
  // Copies so many bytes, or until a handle has its value: then that handle. None: `left` is 0, or nothing is
  // under way.
  pair_index advance(std::size_t& left) noexcept {
    while (left != 0 && !turns_.empty()) {
      const pair_index pair = turns_.pop();
      delivery& one = rows_[pair];
      one.in_turns = false;
      if (!one.value) continue; // another one began, and ended
      if (one.generation != state_.pair_rows[pair].generation || !state_.pair_rows[pair].busy) {
        end(pair);
        continue;
      }
      std::byte* const value = state_.pairs[pair].service.in.memory.value(one.slot);
      const std::size_t bytes = std::min<std::size_t>(left, one.header.bytes - one.done);
      state_.chunks.copy(one.value, one.done, one.place, {value + one.done, bytes});
      one.done += bytes;
      left -= bytes;
      if (one.done == one.header.bytes) {
        local_delivery_.hand_over(pair, one.slot, one.header);
        end(pair);
        return pair;
      }
      one.in_turns = true;
      turns_.push(pair);
    }
    return {};
  }
  // Whether the next cycle is needed at once.
  bool any() const noexcept { return !turns_.empty(); }

 private:
  struct delivery {
    text_id value{};              // none: nothing is under way
    std::uint32_t generation = 0; // of the pair when it began; another one: that handle is gone
    bool in_turns = false;
    std::uint32_t slot = 0;
    std::size_t done = 0;
    chunk_store::place place{};
    detail::value_header header{};
  };
  void end(pair_index pair) noexcept {
    state_.chunks.release(std::exchange(rows_[pair].value, {}));
    state_.pair_rows[pair].busy = false;
  }

  rows<pair_index, delivery> rows_;
  index_ring<pair_index> turns_;
};

} // namespace rowe::service
