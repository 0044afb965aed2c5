// SPDX-License-Identifier: Apache-2.0
// Rows that take turns: a row that has had its turn goes behind all others. There is a place for each row,
// and a row stands in the ring at most once, so it is never full. Service thread only; constant time, no
// allocation.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rowe::service {

template <class Id>
class index_ring {
 public:
  // As many places as there are rows; they must outlive the ring.
  explicit index_ring(std::span<Id> places) noexcept : places_{places} {}

  bool empty() const noexcept { return count_ == 0; }
  std::uint32_t count() const noexcept { return count_; }
  void push(Id which) noexcept {
    assert(count_ < places_.size());
    const std::size_t at = std::size_t{first_} + count_++;
    places_[at < places_.size() ? at : at - places_.size()] = which;
  }
  // The row that has waited longest. The ring must not be empty.
  Id pop() noexcept {
    assert(count_ > 0);
    const Id which = places_[first_];
    if (++first_ == places_.size()) first_ = 0;
    --count_;
    return which;
  }

 private:
  std::span<Id> places_;
  std::uint32_t first_ = 0;
  std::uint32_t count_ = 0;
};

} // namespace rowe::service
