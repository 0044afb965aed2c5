// SPDX-License-Identifier: Apache-2.0
// The cells of parameters, and the word that says that a handle has set, opened or closed one. Set-up finds
// free cells under its lock; the service thread looks at all cells when the word is set.
#pragma once
#include <cstddef>
#include <span>

#include <rowe/detail/parameter_cell.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/notification.hpp>

namespace rowe::service {

class parameter_table {
 public:
  using cell = detail::parameter_cell;

  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<cell>(bounds.parameters_max);
  }
  parameter_table(rt::arena& memory, const limits& bounds) noexcept
      : cells_{memory.carve<cell>(bounds.parameters_max)} {}

  std::span<cell> cells() noexcept { return cells_; }

  // Set-up, under its lock. The cell of an open parameter of this name, in either spelling; null: none.
  cell* find(std::string_view name) noexcept;
  // A free cell, made active with what is asked. Null: all are taken.
  cell* open(const detail::parameter_request& asked, int wake_descriptor) noexcept;
  // Writes all of a free cell but its state.
  static void build(cell& made, const detail::parameter_request& asked, rt::std_atomics::variable<bool>& news,
                    int wake_descriptor) noexcept;
  // Set-up: whether the service thread is to free a cell yet; it notifies `freed`.
  bool any_closing() const noexcept;
  // The handle's thread.
  void close(cell& of) noexcept;
  // When the service thread is gone.
  void end() noexcept;
  // In a child of fork(), which has a table of its own: closes all cells, and forgets whom they wake.
  void end_in_child() noexcept;

  rt::notification<> freed; // of whoever sets up

  // The service thread: whether to look at all cells.
  bool take_news() noexcept {
    // relaxed: only a hint; the exchange reads the newest. acquire: pairs with the releases of those who set
    // it, so what they wrote before is seen
    return news_.load(std::memory_order_relaxed) && news_.exchange(false, std::memory_order_acquire);
  }

 private:
  cell* find_free(std::string_view name) noexcept;
  void announce() noexcept {
    news_.store(true, std::memory_order_release); // release: pairs with the exchange in take_news()
  }

  std::span<cell> cells_;
  std::size_t next_ = 0; // the cell behind the one that was opened last
  rt::std_atomics::variable<bool> news_{false};
};

} // namespace rowe::service
