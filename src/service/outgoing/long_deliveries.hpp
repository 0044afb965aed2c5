// SPDX-License-Identifier: Apache-2.0
// Copies long values into the inboxes of handles, some of each in a cycle: a handle reads contiguous memory,
// and one copy of tens of megabytes would hold up everything else. Until a handle has its long value, it is
// given no other one, so values do not overtake each other; those are counted as inbox_full.
//
// Service thread only; nothing waits or allocates. A user thread that sleeps is woken, which enters the
// kernel.
#pragma once
#include <cstddef>
#include <cstdint>

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
    return rt::arena::bytes_for<delivery>(bounds.lanes_max) +
           rt::arena::bytes_for<pair_index>(bounds.lanes_max);
  }
  long_deliveries(rt::arena& memory, const long_deliveries_needs& parts) noexcept
      : long_deliveries_needs{parts},
        rows_{memory.carve<delivery>(state_.bounds().lanes_max)},
        turns_{memory.carve<pair_index>(state_.bounds().lanes_max)} {}

  // Begins to deliver a value. Errors: full; too_big, also where the handle reads structs.
  status begin(pair_index pair, const detail::value_header& header, text_id value) noexcept;
  // Copies so many bytes, or until a handle has its value: then that handle. None: `left` is 0, or nothing is
  // under way.
  pair_index advance(std::size_t& left) noexcept;
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
  void end(pair_index pair) noexcept;

  rows<pair_index, delivery> rows_;
  index_ring<pair_index> turns_;
};

} // namespace rowe::service
