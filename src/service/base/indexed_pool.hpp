// SPDX-License-Identifier: Apache-2.0
// The free rows of a table, or of one range of it: a list through the rows themselves, so it takes no memory
// of its own. A row that is taken may use its link for something else. Rows come lowest first, and then last
// in first out: the numbers of calls are seen on the wire, so this order is part of what peers see.
//
// Service thread only. Nothing waits or allocates; each function takes a constant number of steps, but for
// the constructor and check().
#pragma once
#include <cassert>
#include <cstdint>

#include "service/base/ids.hpp"

namespace rowe::service {

template <class Id, class T, Id T::*Link>
class indexed_pool {
 public:
  // The rows from `first` up to, and without, `end` are free. `all` must outlive the pool.
  indexed_pool(rows<Id, T> all, std::uint32_t first, std::uint32_t end) noexcept
      : all_{all}, first_row_{first}, end_row_{end}, free_{end - first} {
    assert(first <= end && end <= all.size());
    for (std::uint32_t i = end; i-- > first;) {
      all_[Id{i}].*Link = head_;
      head_ = Id{i};
    }
  }
  explicit indexed_pool(rows<Id, T> all) noexcept : indexed_pool{all, 0, all.size()} {}

  // Takes a free row; `none` if there is none. The row holds what it held when it was given back.
  Id take() noexcept {
    const Id taken = head_;
    if (!taken) return taken;
    head_ = all_[taken].*Link;
    --free_;
    return taken;
  }
  // The row must have been taken from this pool.
  void give_back(Id which) noexcept {
    assert(which.value >= first_row_ && which.value < end_row_ && free_ < end_row_ - first_row_);
    all_[which].*Link = head_;
    head_ = which;
    ++free_;
  }

  bool empty() const noexcept { return !head_; } // nothing is free
  std::uint32_t free() const noexcept { return free_; }
  std::uint32_t size() const noexcept { return end_row_ - first_row_; }
  std::uint32_t in_use() const noexcept { return end_row_ - first_row_ - free_; }

  // True when as many rows of the range are free as are counted, and `may_be_free(row)` holds for each. For
  // tests. Takes as many steps as rows are free.
  template <class MayBeFree>
  bool check(MayBeFree&& may_be_free) const {
    std::uint32_t count = 0;
    for (Id i = head_; i; i = all_[i].*Link) {
      if (i.value < first_row_ || i.value >= end_row_ || ++count > free_ || !may_be_free(all_[i]))
        return false;
    }
    return count == free_;
  }

 private:
  rows<Id, T> all_;
  std::uint32_t first_row_;
  std::uint32_t end_row_;
  std::uint32_t free_;
  Id head_{};
};

} // namespace rowe::service
