// SPDX-License-Identifier: Apache-2.0
// The connected peers, by the index that the transport gives them. Service thread only; nothing waits or
// allocates.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/state/connection.hpp"

namespace rowe::service {

class peer_table {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<connection>(bounds.connections_max);
  }
  peer_table(rt::arena& memory, const limits& bounds) noexcept
      : rows_{memory.carve<connection>(bounds.connections_max)} {}

  connection& operator[](peer_index which) const noexcept { return rows_[which]; }
  std::uint32_t size() const noexcept { return rows_.size(); }
  auto begin() const noexcept { return rows_.begin(); }
  auto end() const noexcept { return rows_.end(); }
  auto ids() const noexcept { return rows_.ids(); }

  // Null: the peer is gone.
  connection* find(connection_id id) const noexcept {
    if (!rows_.contains({id.index})) return nullptr;
    connection& c = rows_[{id.index}];
    return c.state != connection::phase::free && c.id == id ? &c : nullptr;
  }

  // Parts do not close peers. A part calls this with the close reason, and from then on the peer counts as
  // closed. The core closes it when the part has returned, or, if many are to be closed, in a later cycle.
  void close_later(connection& c, std::string_view why,
                   std::uint16_t code = wire::close_code::policy) noexcept {
    if (!c.open()) return; // it is closed for what came first
    c.state = connection::phase::to_close;
    c.close_reason = why;
    c.closes_as = code;
    wants_close_ = true;
    marked_from_ = std::min(marked_from_, c.id.index);
  }
  bool wants_close() const noexcept { return wants_close_; }
  // The next one to close. Null: there is none, or so many were closed that the others wait for a cycle.
  connection* take_marked() noexcept {
    if (!wants_close_ || closes_left_ == 0) return nullptr;
    for (; marked_from_ < rows_.size(); ++marked_from_) {
      connection& c = rows_[{marked_from_}];
      if (c.state != connection::phase::to_close) continue;
      c.state = connection::phase::open;
      --closes_left_;
      return &c;
    }
    wants_close_ = false;
    closes_left_ = closes_per_cycle;
    return nullptr;
  }
  // At the end of a cycle: whether the next one is to close some.
  bool closes_in_next_cycle() noexcept {
    if (!wants_close_) return false;
    closes_left_ = closes_per_cycle;
    return true;
  }

  // A client's server, if it is connected; else null.
  connection* server() const noexcept {
    for (connection& c : rows_) {
      if (c.open() && c.ours == side::client) return &c;
    }
    return nullptr;
  }

  // A peer took a free row; a peer left, and its row is free again.
  void add() noexcept { ++count_, ++opened_; }
  void remove() noexcept { --count_; }
  std::uint32_t count() const noexcept { return count_; }
  std::uint32_t opened() const noexcept { return opened_; } // so far

  bool check() const noexcept {
    std::uint32_t there = 0;
    for (const peer_index i : rows_.ids()) {
      const connection& c = rows_[i];
      if (c.state == connection::phase::free) continue;
      if (c.id.index != i.value) return false;
      ++there;
    }
    return there == count_;
  }

 private:
  rows<peer_index, connection> rows_;
  std::uint32_t count_ = 0;
  std::uint32_t opened_ = 0;
  bool wants_close_ = false;
  std::uint32_t marked_from_ = 0; // none before it is marked
  std::uint32_t closes_left_ = closes_per_cycle;
};

} // namespace rowe::service
