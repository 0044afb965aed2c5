// SPDX-License-Identifier: Apache-2.0
// The connected peers, by the index that the transport gives them. Service thread only; nothing waits or
// allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/connection.hpp"
#include "service/ids.hpp"

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
  // closed. The core closes it when the part has returned.
  void close_later(connection& c, std::string_view why,
                   std::uint16_t code = wire::close_code::policy) noexcept {
    if (!c.open()) return; // it is closed for what came first
    c.state = connection::phase::to_close;
    c.close_reason = why;
    c.closes_as = code;
    wants_close_ = true;
  }
  bool wants_close() const noexcept { return wants_close_; }
  void closed_all() noexcept { wants_close_ = false; }

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
};

} // namespace rowe::service
