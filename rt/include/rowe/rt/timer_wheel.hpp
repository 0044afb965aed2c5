// SPDX-License-Identifier: Apache-2.0
// The expiry index: which of many things come due next, in a number of steps that does not depend on how many
// there are. Time is passed in; there is no clock, no thread and no callback: the caller pulls what is due
// until there is nothing more. One thread.
//
// The scheme is the hierarchical timing wheel of Varghese and Lauck, without ticks. Time is cut into ticks of
// 2^TickBits ns and a tick number into digits of 6 bits. An entry lies on the level of the highest digit in
// which its tick differs from the current one, in the slot that this digit names; so a slot of level 0 holds
// one tick, one of level 1 sixty-four ticks, and what lies on a lower level is always due before what lies on
// a higher one. A bitmap for each level says which slots hold anything: the next one is found by counting
// zeros, and time passes over empty slots at no cost. When time reaches a slot of a higher level, its entries
// move down; an entry moves at most levels - 1 times in its life.
//
// As no slot that holds anything has been reached, an entry's slot follows at any moment from its expiry and
// the current tick: entries need not remember where they are, and cancelling takes as few steps as inserting.
//
// The wheel finds what may be expired, the clock decides. It never reports early; it reports late by less
// than one tick (65.5 us by default), because ticks round up. So whoever must not use a thing a moment too
// long compares its expiry with `now` at the point of use, and leaves it to the wheel that the thing is given
// back.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::rt {

// One entry, in an array of the caller's; only the wheel writes it.
struct timer_node {
  std::uint32_t next = 0;
  std::uint32_t previous = 0;
  time_point expiry = never; // never: not on the wheel
};
static_assert(sizeof(timer_node) == 16);

template <unsigned TickBits = 16>
class basic_timer_wheel {
 public:
  static_assert(TickBits >= 3 && TickBits <= 32);
  static constexpr duration tick{std::int64_t{1} << TickBits};
  static constexpr std::uint32_t none = ~std::uint32_t{0}; // no entry; also the bound on their number

  // Entry i is nodes[i], for as long as the wheel lives. `start` is the current time, not before the clock's
  // origin.
  basic_timer_wheel(std::span<timer_node> nodes, time_point start) noexcept;
  basic_timer_wheel(const basic_timer_wheel&) = delete;
  basic_timer_wheel& operator=(const basic_timer_wheel&) = delete;

  // Puts an entry on the wheel; one that is on it already is moved. `never` takes it off. An expiry in the
  // past is due at once: the next expire() reports it. Constant time, never waits, never allocates.
  ROWE_RT void insert(std::uint32_t node, time_point expiry) noexcept;
  // Takes an entry off; does nothing when it is not on the wheel. Constant time.
  ROWE_RT void cancel(std::uint32_t node) noexcept;
  // Two hints for a caller that knows which entries it will cancel. Among a million, one that has not been
  // touched for long lies outside the caches, as do the two entries beside it in its list, and cancelling it
  // waits for them. The first asks for the entry's cache line, the second, once that has arrived, for those
  // of its neighbours. Nothing changes, whether they are called or not. Constant time, never wait.
  ROWE_RT void prefetch(std::uint32_t node) const noexcept;
  ROWE_RT void prefetch_neighbours(std::uint32_t node) const noexcept;
  // Takes one entry off whose expiry has passed and returns it; `none` when there is no more. Call until
  // `none`. Entries come in the order of their ticks, those that were inserted after their time behind what
  // was due then. `now` before an earlier `now` counts as that one. Usually a few steps; when time reaches a
  // slot of a higher level, as many as that slot has entries.
  ROWE_RT std::uint32_t expire(time_point now) noexcept;
  // The earliest time at which expire() can have something to do: never later than the truth, exact when it
  // is in the current 64 ticks, else the beginning of the slot in which the next entry lies (so that one who
  // sleeps on it wakes at most levels - 1 times in vain for an entry). `never` when the wheel is empty.
  ROWE_RT time_point next_wake() const noexcept;

  ROWE_RT bool contains(std::uint32_t node) const noexcept { return nodes_[node].expiry != never; }
  // `never` when it is not on the wheel.
  ROWE_RT time_point expiry_of(std::uint32_t node) const noexcept { return nodes_[node].expiry; }
  ROWE_RT std::uint32_t size() const noexcept { return size_; }
  ROWE_RT bool empty() const noexcept { return size_ == 0; }

  // The invariant that is broken, or nullptr. Looks at everything; for tests, after every step.
  const char* check() const noexcept;

 private:
  static constexpr unsigned digit_bits = 6;
  static constexpr unsigned slot_count = 1u << digit_bits;
  // Enough for every time_point: rounding up, a tick number has up to 64 - TickBits bits.
  static constexpr unsigned levels = (64 - TickBits + digit_bits - 1) / digit_bits;
  static constexpr unsigned due_list = levels * slot_count; // the list of what is due already
  using tick_number = std::uint64_t;
  static constexpr tick_number no_tick = ~tick_number{0}; // after every time_point

  // Rounded up: at the beginning of this tick the expiry has passed.
  static constexpr tick_number tick_at_or_after(time_point t) noexcept {
    const std::int64_t ns = nanoseconds_of(t);
    return ns <= 0 ? 0 : (static_cast<tick_number>(ns - 1) >> TickBits) + 1;
  }
  // Rounded down: the tick that has begun.
  static constexpr tick_number tick_at_or_before(time_point t) noexcept {
    const std::int64_t ns = nanoseconds_of(t);
    return ns <= 0 ? 0 : static_cast<tick_number>(ns) >> TickBits;
  }
  static constexpr time_point time_of(tick_number at) noexcept {
    constexpr tick_number end = static_cast<tick_number>(never.time_since_epoch().count()) >> TickBits;
    return at > end ? never : time_point{duration{static_cast<std::int64_t>(at << TickBits)}};
  }

  // Where an entry lies that expires then.
  unsigned list_of(time_point expiry) const noexcept;
  // The tick at which time next reaches a slot that holds anything, and that slot's list; no_tick when none
  // does.
  tick_number next_slot(unsigned& list) const noexcept;
  void link(std::uint32_t node, unsigned list) noexcept;
  void unlink(std::uint32_t node, unsigned list) noexcept;
  void move_down(unsigned list) noexcept;
  void mark_empty(unsigned list) noexcept;
  const char* check_list(unsigned list, std::uint32_t& counted) const noexcept;

  std::span<timer_node> nodes_;
  tick_number now_; // the tick that time has reached
  std::uint32_t size_ = 0;
  std::uint32_t occupied_levels_ = 0;            // bit L: occupied_[L] is not 0
  std::array<std::uint64_t, levels> occupied_{}; // bit s of level L: that slot's list is not empty
  // The first entry of each list, or none. The lists are circular: the first one's `previous` is the last
  // one.
  std::array<std::uint32_t, due_list + 1> first_;
};

template <unsigned TickBits>
basic_timer_wheel<TickBits>::basic_timer_wheel(std::span<timer_node> nodes, time_point start) noexcept
    : nodes_{nodes}, now_{tick_at_or_before(start)} {
  assert(nodes.size() < none);
  for (timer_node& node : nodes) node = timer_node{};
  first_.fill(none);
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::insert(std::uint32_t node, time_point expiry) noexcept {
  cancel(node);
  if (expiry == never) return;
  nodes_[node].expiry = expiry;
  link(node, list_of(expiry));
  ++size_;
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::cancel(std::uint32_t node) noexcept {
  assert(node < nodes_.size());
  if (!contains(node)) return;
  unlink(node, list_of(nodes_[node].expiry));
  nodes_[node].expiry = never;
  --size_;
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::prefetch(std::uint32_t node) const noexcept {
  assert(node < nodes_.size());
  __builtin_prefetch(&nodes_[node], 1);
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::prefetch_neighbours(std::uint32_t node) const noexcept {
  assert(node < nodes_.size());
  const timer_node& entry = nodes_[node];
  __builtin_prefetch(&nodes_[entry.next], 1);
  __builtin_prefetch(&nodes_[entry.previous], 1);
}

template <unsigned TickBits>
std::uint32_t basic_timer_wheel<TickBits>::expire(time_point now) noexcept {
  const tick_number target = (std::max)(now_, tick_at_or_before(now));
  // Each turn but the last reaches a slot that holds something, and moves its entries at least one level
  // down.
  while (first_[due_list] == none) {
    unsigned list = due_list;
    const tick_number at = next_slot(list);
    if (at > target) {
      now_ = target; // everything lies beyond it, so no entry's list changes
      return none;
    }
    now_ = at;
    move_down(list);
  }
  const std::uint32_t node = first_[due_list];
  unlink(node, due_list);
  nodes_[node].expiry = never;
  --size_;
  return node;
}

template <unsigned TickBits>
time_point basic_timer_wheel<TickBits>::next_wake() const noexcept {
  unsigned list = due_list;
  return time_of(first_[due_list] != none ? now_ : next_slot(list));
}

template <unsigned TickBits>
unsigned basic_timer_wheel<TickBits>::list_of(time_point expiry) const noexcept {
  const tick_number at = tick_at_or_after(expiry);
  if (at <= now_) return due_list;
  const unsigned level = (static_cast<unsigned>(std::bit_width(at ^ now_)) - 1) / digit_bits;
  const auto slot = static_cast<unsigned>(at >> (level * digit_bits)) % slot_count;
  return level * slot_count + slot;
}

template <unsigned TickBits>
auto basic_timer_wheel<TickBits>::next_slot(unsigned& list) const noexcept -> tick_number {
  // Entries of a level share all higher digits with the current tick and are ahead in the level's own: the
  // lowest level that holds anything comes first, and on it the lowest slot.
  if (occupied_levels_ == 0) return no_tick;
  const auto level = static_cast<unsigned>(std::countr_zero(occupied_levels_));
  const auto slot = static_cast<unsigned>(std::countr_zero(occupied_[level]));
  list = level * slot_count + slot;
  const unsigned shift = level * digit_bits;
  return (((now_ >> shift) & ~tick_number{slot_count - 1}) | slot) << shift;
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::link(std::uint32_t node, unsigned list) noexcept {
  const std::uint32_t first = first_[list];
  if (first != none) { // behind the last one
    const std::uint32_t last = nodes_[first].previous;
    nodes_[node].next = first;
    nodes_[node].previous = last;
    nodes_[last].next = node;
    nodes_[first].previous = node;
    return;
  }
  nodes_[node].next = nodes_[node].previous = node;
  first_[list] = node;
  if (list == due_list) return;
  occupied_[list / slot_count] |= std::uint64_t{1} << (list % slot_count);
  occupied_levels_ |= 1u << (list / slot_count);
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::unlink(std::uint32_t node, unsigned list) noexcept {
  const auto [next, previous, expiry] = nodes_[node];
  if (next == node) {
    mark_empty(list);
    return;
  }
  nodes_[previous].next = next;
  nodes_[next].previous = previous;
  if (first_[list] == node) first_[list] = next;
}

template <unsigned TickBits>
void basic_timer_wheel<TickBits>::mark_empty(unsigned list) noexcept {
  first_[list] = none;
  if (list == due_list) return;
  std::uint64_t& level = occupied_[list / slot_count];
  level &= ~(std::uint64_t{1} << (list % slot_count));
  if (level == 0) occupied_levels_ &= ~(1u << (list / slot_count));
}

// Spreads the list that time has just reached over the lower levels, in its order. Only while nothing is due.
template <unsigned TickBits>
void basic_timer_wheel<TickBits>::move_down(unsigned list) noexcept {
  const std::uint32_t first = first_[list];
  mark_empty(list);
  if (list < slot_count) { // one tick: all of it is due
    first_[due_list] = first;
    return;
  }
  std::uint32_t node = first;
  do {
    const std::uint32_t next = nodes_[node].next; // link() overwrites it
    link(node, list_of(nodes_[node].expiry));
    node = next;
  } while (node != first);
}

template <unsigned TickBits>
const char* basic_timer_wheel<TickBits>::check() const noexcept {
  std::uint32_t counted = 0;
  const char* broken = check_list(due_list, counted);
  for (unsigned level = 0; level < levels && broken == nullptr; ++level) {
    std::uint64_t holding = 0;
    for (unsigned slot = 0; slot < slot_count; ++slot) {
      holding |= std::uint64_t{first_[level * slot_count + slot] != none} << slot;
    }
    if (holding != occupied_[level]) return "a slot is marked when its list holds anything";
    const bool marked = (occupied_levels_ >> level & 1) != 0;
    if (marked != (holding != 0)) return "a level is marked when its bitmap holds anything";
    for (; holding != 0 && broken == nullptr; holding &= holding - 1) {
      broken = check_list(level * slot_count + static_cast<unsigned>(std::countr_zero(holding)), counted);
    }
  }
  if (broken != nullptr) return broken;
  if (counted != size_) return "the lists together hold size() entries";
  std::uint32_t inserted = 0;
  for (const timer_node& node : nodes_) inserted += node.expiry != never;
  return inserted == size_ ? nullptr : "an entry that has an expiry is in a list";
}

template <unsigned TickBits>
const char* basic_timer_wheel<TickBits>::check_list(unsigned list, std::uint32_t& counted) const noexcept {
  const std::uint32_t first = first_[list];
  if (first == none) return nullptr;
  std::uint32_t node = first;
  do {
    if (node >= nodes_.size()) return "a list stays in the array";
    if (++counted > nodes_.size()) return "a list closes";
    const auto [next, previous, expiry] = nodes_[node];
    if (expiry == never) return "an entry in a list has an expiry";
    if (list_of(expiry) != list) return "an entry lies in the list that its expiry says";
    if (next >= nodes_.size() || nodes_[next].previous != node) return "neighbours know each other";
    node = next;
  } while (node != first);
  return nullptr;
}

using timer_wheel = basic_timer_wheel<>;

} // namespace rowe::rt
