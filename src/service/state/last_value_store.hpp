// SPDX-License-Identifier: Apache-2.0
// The last values of topics that somebody has asked for over HTTP lately. They have memory of their own, and
// take no wire slot from messages. Where it is short, the value that was asked for longest ago goes. A topic
// has the number of its row (topic::asked), so nothing is searched for when it is published.
//
// A long value stays in its chunks. All long ones here have a quarter of the chunks at most, and go where
// others need the chunks.
//
// Service thread only; nothing here waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/ids.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/state/latch_store.hpp"

namespace rowe::service {

class last_value_store {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // `chunks`: where long values are.
  last_value_store(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept;

  // Begins to retain the values of a topic. None: asked_topics_max are taken.
  last_value_id add(topic_id topic, rt::time_point now) noexcept;
  // A topic whose row is given to another one: that which was asked for longest ago, of those for whose value
  // nobody waits if there are any; else of all. Who waits asks again, and so is among the last. Linear.
  topic_id replaceable(rt::time_point now) const noexcept;
  // A topic that nobody has asked for in asked_topic_retained_for; none: there is none. Linear.
  topic_id unasked(rt::time_point now) const noexcept;
  void remove(last_value_id which) noexcept; // nothing, if it is none

  // The topic has a new value.
  void keep(last_value_id which, std::string_view body, rt::time_point published,
            rt::time_point expires) noexcept;
  // The topic has a new value, which is long. If it finds no room, only its length is recorded.
  void keep_long(last_value_id which, text_id value, rt::time_point published,
                 rt::time_point expires) noexcept;
  // Others need chunks: gives up the long value that was asked for longest ago. False: there is none.
  bool give_up_long() noexcept;
  // How long the last value was, if it found no room for that; else 0.
  std::size_t long_bytes(last_value_id which) const noexcept { return rows_[which].long_bytes; }
  // Somebody asks for the value, and, if there is none that has not expired, waits for the next one or not.
  const latched_value& ask(last_value_id which, rt::time_point now, bool waits) noexcept;
  void write(const latched_value& what, json::writer& into) const noexcept { texts_.write(what, into); }

  // How often a value has come that somebody waited for.
  std::uint64_t came() const noexcept { return came_; }
  // Whoever waits is to ask again.
  void end_waits() noexcept { ++came_; }

  topic_id topic_of(last_value_id which) const noexcept { return rows_[which].topic; }
  std::uint32_t in_use() const noexcept { return free_.in_use(); }
  // Each block belongs to a row that is in use.
  bool check() const noexcept;

 private:
  struct row {
    topic_id topic{}; // none: the row is free
    last_value_id next_free{};
    bool awaited = false; // somebody waits for the next value
    rt::time_point asked_at{};
    latched_value value;
    std::size_t long_bytes = 0;
  };

  bool drop_oldest_but(last_value_id kept, bool long_ones) noexcept;

  chunk_store& chunks_;
  rows<last_value_id, row> rows_;
  indexed_pool<last_value_id, row, &row::next_free> free_;
  latch_store texts_;
  std::uint64_t came_ = 0;
};

} // namespace rowe::service
