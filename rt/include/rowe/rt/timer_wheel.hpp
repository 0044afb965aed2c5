// SPDX-License-Identifier: Apache-2.0
// The expiry index: which of many things come due next, in a number of steps that does not depend on how many
// there are. Time is passed in; there is no clock, no thread and no callback: the caller pulls what is due
// until there is nothing more. One thread.
//
// The scheme is the hierarchical timing wheel of Varghese and Lauck, without ticks. Time is cut into ticks of
// 2^TickBits ns and a tick number into digits of 6 bits. An entry lies on the level of the highest digit in
// which its tick differs from the current one, in the slot that this digit names; so a slot of level 0 holds
// one tick, one of level 1 sixty-four ticks, and what lies on a lower level is always due before what lies on
// a higher one. A bitmap a level tells which slots hold anything: the next one is found by counting zeros,
// and time passes over empty slots at no cost. When time reaches a slot of a higher level, its entries move
// down; an entry moves at most levels - 1 times in its life.
//
// As no slot that holds anything has been reached, an entry's slot follows at any moment from its expiry and
// the current tick: entries need not remember where they are, and cancelling takes as few steps as inserting.
//
// The wheel finds what may be dead, the clock decides. It never reports early; it reports late by less than
// one tick (65.5 us by default), because ticks round up. So whoever must not use a thing a moment too long
// compares its expiry with `now` at the point of use, and leaves it to the wheel that the thing is given
// back.
#pragma once
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

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
  // Takes one entry off whose expiry has passed and returns it; `none` when there is no more. Call until
  // `none`. Entries come in the order of their ticks. `now` before an earlier `now` counts as that one.
  // Usually a few steps; when time reaches a slot of a higher level, as many as that slot has entries.
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

  // Looks at everything; for tests, after every step. Empty when all invariants hold, else which one does
  // not.
  std::string_view check() const noexcept;

 private:
  static constexpr unsigned digit_bits = 6;
  static constexpr unsigned slots = 1u << digit_bits;
  static constexpr unsigned levels =
      (63 - TickBits + digit_bits - 1) / digit_bits;   // enough for every time_point
  static constexpr unsigned due_list = levels * slots; // the list of what is due already
  using tick_number = std::uint64_t;

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

  unsigned list_of(time_point expiry) const noexcept;
  void link(std::uint32_t node, unsigned list) noexcept;
  void unlink(std::uint32_t node, unsigned list) noexcept;
  void move_down(unsigned list) noexcept;
  tick_number next_slot(unsigned& list) const noexcept;

  std::span<timer_node> nodes_;
  tick_number now_; // the tick that time has reached
  std::uint32_t size_ = 0;
  std::uint32_t occupied_levels_ = 0;            // bit L: occupied_[L] is not 0
  std::array<std::uint64_t, levels> occupied_{}; // bit s of level L: that slot's list is not empty
  std::array<std::uint32_t, due_list + 1>
      first_; // circular lists: the first one's `previous` is the last one
};

using timer_wheel = basic_timer_wheel<>;

} // namespace rowe::rt
