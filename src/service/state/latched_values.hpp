// SPDX-License-Identifier: Apache-2.0
// Which last values each latched topic has: one of every publisher, as in ROS; the handles of this process on
// a topic are each a publisher, too. A late subscriber gets them all, the oldest first. latch_store.hpp has
// their texts, and how much each publisher may hold.
//
// Service thread only; nothing waits or allocates. Each function takes as many steps as the topic has values,
// at most.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/chunk_store.hpp"
#include "service/base/index_list.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/state/latch_store.hpp"

namespace rowe::service {

struct latched_row {
  latch_id next{};
  std::uint64_t number = 0; // values that came later have higher ones; 0: the row has none
  latched_value value;
};
// Where a reader of a topic's values is: behind the value that has this number, in this row. Number 0: in
// front of all.
struct latched_place {
  latch_id row{};
  std::uint64_t number = 0;
};
using latched_list = index_queue<latch_id, latched_row, &latched_row::next>; // the oldest value first

class latched_values {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  latched_values(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept;

  // Retains a value in place of what its owner had on this topic. False: there is no room, or the owner may
  // not hold so much; then it has none. A short value that finds no room among the short ones goes where the
  // long ones are.
  bool keep(latched_list& of, std::string_view body, latch_owner owner, rt::time_point published,
            rt::time_point expires) noexcept;
  // The same for a long value, to which a reference is held.
  bool keep_long(latched_list& of, text_id value, latch_owner owner, rt::time_point published,
                 rt::time_point expires) noexcept;
  void forget(latched_list& of, latch_owner owner) noexcept;
  void clear(latched_list& of) noexcept;
  void drop_expired(latched_list& of, rt::time_point now) noexcept;

  // The number of the newest value of all topics; 0: there was none.
  std::uint64_t newest() const noexcept { return last_number_; }
  // The oldest value behind `after` whose number is `until` at most; none: there is none. In one step where
  // the value at `after` is still there.
  latch_id next(const latched_list& of, const latched_place& after, std::uint64_t until) const noexcept;
  const latched_row& at(latch_id which) const noexcept { return rows_[which]; }
  void write(const latched_value& what, json::writer& into) const noexcept { texts_.write(what, into); }

  const latch_store& texts() const noexcept { return texts_; }
  std::uint32_t count() const noexcept { return free_.in_use(); }

 private:
  // A row with no value; none: there is none left.
  latch_id begin(latched_list& of, latch_owner owner) noexcept;
  bool end(latched_list& of, latch_id row, bool kept, rt::time_point published) noexcept;
  void release(latch_id row) noexcept;

  chunk_store& chunks_;
  latch_store texts_;
  rows<latch_id, latched_row> rows_;
  indexed_pool<latch_id, latched_row, &latched_row::next> free_;
  std::uint64_t last_number_ = 0;
};

} // namespace rowe::service
