// SPDX-License-Identifier: Apache-2.0
// Lists through the rows of a table: a row that is on a list has links to its neighbours. The list itself is
// three numbers at most. It does not know its table; each call passes the table. So a table may hold
// thousands of lists. Service thread only; nothing waits or allocates.
#pragma once
#include <cassert>
#include <cstdint>

#include "service/base/ids.hpp"

namespace rowe::service {

// A link to the next row.
template <class Id, class T, Id T::*Next>
struct index_queue {
  Id head{};
  Id tail{};

  bool empty() const noexcept { return !head; }
  void push_back(rows<Id, T> all, Id which) noexcept {
    all[which].*Next = Id{};
    if (empty()) {
      head = which;
    } else {
      all[tail].*Next = which;
    }
    tail = which;
  }
  void push_front(rows<Id, T> all, Id which) noexcept {
    all[which].*Next = head;
    if (empty()) tail = which;
    head = which;
  }
  // The queue must not be empty.
  Id pop_front(rows<Id, T> all) noexcept {
    assert(!empty());
    const Id first = head;
    head = all[first].*Next;
    if (empty()) tail = Id{};
    return first;
  }
  // Takes out the row behind `before`, or the first row if `before` is none. For a walk that takes rows out.
  void erase_behind(rows<Id, T> all, Id before) noexcept {
    if (!before) {
      (void)pop_front(all);
      return;
    }
    const Id which = all[before].*Next;
    all[before].*Next = all[which].*Next;
    if (tail == which) tail = before;
  }
  // Takes out a row, in as many steps as rows stand in front of it. False, and nothing changes, if it is not
  // on the queue.
  bool erase(rows<Id, T> all, Id which) noexcept {
    Id before{};
    for (Id i = head; i; before = i, i = all[i].*Next) {
      if (i != which) continue;
      erase_behind(all, before);
      return true;
    }
    return false;
  }
};

// With links both ways: a row is taken out in a constant number of steps.
template <class Id, class T, Id T::*Next, Id T::*Previous>
struct index_list {
  Id head{};
  Id tail{};
  std::uint32_t count = 0;

  bool empty() const noexcept { return count == 0; }
  void push_front(rows<Id, T> all, Id which) noexcept {
    all[which].*Previous = Id{};
    all[which].*Next = head;
    (head ? all[head].*Previous : tail) = which;
    head = which;
    ++count;
  }
  void push_back(rows<Id, T> all, Id which) noexcept {
    all[which].*Previous = tail;
    all[which].*Next = Id{};
    (tail ? all[tail].*Next : head) = which;
    tail = which;
    ++count;
  }
  // The row must be on this list.
  void erase(rows<Id, T> all, Id which) noexcept {
    assert(count > 0);
    const Id before = all[which].*Previous;
    const Id behind = all[which].*Next;
    (before ? all[before].*Next : head) = behind;
    (behind ? all[behind].*Previous : tail) = before;
    --count;
  }

  // True when the links agree both ways, and with the count; and `belongs(row)` holds for each. For tests.
  template <class Belongs>
  bool check(rows<Id, T> all, Belongs&& belongs) const {
    std::uint32_t counted = 0;
    Id before{};
    for (Id i = head; i; before = i, i = all[i].*Next) {
      if (!all.contains(i) || ++counted > count || all[i].*Previous != before || !belongs(all[i]))
        return false;
    }
    return counted == count && tail == before;
  }
};

} // namespace rowe::service
