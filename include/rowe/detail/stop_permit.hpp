// SPDX-License-Identifier: Apache-2.0
// The stop's shared words: what the service thread grants, and what each loop answers.
//
// The permit is one word: a latch number and a time until which loops may move. The service thread renews it
// while every guard is fresh, so motion ends by itself if that thread dies. To stop, it withdraws the permit
// (time 0). A loop that has once seen the permit of a number withdrawn or over is tripped at that number. A
// permit that is renewed later does not let it go on; only another number does, and only a reset grants one.
// So no interleaving of a stop, a renewal and a late loop lets the loop miss the stop (tests/model).
//
// There are three words. Each has one writer, no loop reads what another loop writes, and nobody ever waits.
#pragma once
#include <cstdint>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::detail {

// The number of a stop, or of the reset that ended it, for loops: from 1 to latch_number_max, then from 1
// again; 0 is none. For peers, stops have numbers that never come again (service/threads/stop_rules.hpp).
// This one is raised at most once in each latch_period, so it takes latch_turn until it comes again. It never
// becomes a number that a loop's words still have; and if a loop does not look for longest_loop_timeout,
// everything stops anyway.
using latch_number = std::uint16_t;
inline constexpr latch_number latch_number_max = 0xffff;
inline constexpr rt::duration latch_period = std::chrono::milliseconds{1};
inline constexpr rt::duration latch_turn = (latch_number_max - 1) * latch_period;
inline constexpr rt::duration longest_loop_timeout = std::chrono::seconds{10};
static_assert(latch_turn > 2 * longest_loop_timeout);
constexpr latch_number next_latch_number(latch_number n) noexcept {
  return n == latch_number_max ? latch_number{1} : static_cast<latch_number>(n + 1);
}

// A latch number and a time in one word. Times have 48 bits.
namespace permit {
inline constexpr unsigned time_bits = 48;
inline constexpr std::uint64_t time_mask = (std::uint64_t{1} << time_bits) - 1;
inline constexpr unsigned unit_shift = 12; // of a permit's time: 4096 ns, 36 years in 48 bits

ROWE_RT constexpr std::uint64_t units_of(rt::time_point t) noexcept {
  return (static_cast<std::uint64_t>(rt::nanoseconds_of(t)) >> unit_shift) & time_mask;
}
// Rounded down: motion ends up to 4 us early. Time 0 is withdrawn.
constexpr std::uint64_t pack(latch_number number, std::uint64_t time) noexcept {
  return std::uint64_t{number} << time_bits | (time & time_mask);
}
ROWE_RT constexpr latch_number number_of(std::uint64_t word) noexcept {
  return static_cast<latch_number>(word >> time_bits);
}
ROWE_RT constexpr std::uint64_t time_of(std::uint64_t word) noexcept { return word & time_mask; }
} // namespace permit

// Written by the service thread, read by every loop.
template <class Atomics = rt::std_atomics>
class permit_word {
 public:
  // Loops may move until `until`.
  void grant(latch_number number, rt::time_point until) noexcept {
    // release: pairs with the acquire in read(); whatever a thread wrote before it asked for the reset is
    // seen by the loops that the reset lets go
    word_.store(permit::pack(number, permit::units_of(until)), std::memory_order_release);
  }
  void withdraw(latch_number number) noexcept {
    word_.store(permit::pack(number, 0), std::memory_order_release); // release: as in grant()
  }
  ROWE_RT std::uint64_t read() const noexcept {
    return word_.load(std::memory_order_acquire); // acquire: pairs with the releases above
  }

 private:
  alignas(rt::line_bytes) typename Atomics::template variable<std::uint64_t> word_{0};
};

// Written by one loop, read by the service thread.
template <class Atomics = rt::std_atomics>
class latch_words {
  using duration = rt::duration;
  using time_point = rt::time_point;

 public:
  // The loop's.
  ROWE_RT void check_in(time_point now) noexcept {
    // relaxed: a time by itself; the service thread only compares it with its own clock
    checked_in_ns_.store(rt::nanoseconds_of(now), std::memory_order_relaxed);
  }
  ROWE_RT void trip(latch_number number) noexcept {
    tripped_.store(number, std::memory_order_release); // release: pairs with the acquire in tripped()
  }
  ROWE_RT void acknowledge(latch_number number, time_point now) noexcept {
    const auto low = static_cast<std::uint64_t>(rt::nanoseconds_of(now));
    // release: pairs with the acquire in acknowledged(); so what the loop commanded before comes before the
    // service thread's answer to the peer
    acknowledged_.store(permit::pack(number, low), std::memory_order_release);
  }

  // Of both: when the loop looked last. Zero: never.
  ROWE_RT time_point checked_in() const noexcept {
    // relaxed: pairs with the store in check_in(), and see there
    return time_point{duration{checked_in_ns_.load(std::memory_order_relaxed)}};
  }
  // The service thread's.
  latch_number tripped() const noexcept {
    return tripped_.load(std::memory_order_acquire); // acquire: pairs with the release in trip()
  }
  struct acknowledgment {
    latch_number number = 0;
    time_point at{};
  };
  // The word has the low 48 bits of the time; `now` completes it, correctly for three days. A loop's clock
  // may be ahead of the reader's `now` by the length of a cycle.
  acknowledgment acknowledged(time_point now) const noexcept {
    // acquire: pairs with the release in acknowledge()
    const std::uint64_t word = acknowledged_.load(std::memory_order_acquire);
    const auto reference = static_cast<std::uint64_t>(rt::nanoseconds_of(now));
    // The latest time with these low bits that is not more than an hour ahead.
    constexpr std::uint64_t hour = 3'600'000'000'000;
    const std::uint64_t ago = (reference + hour - permit::time_of(word)) & permit::time_mask;
    return {permit::number_of(word), time_point{duration{static_cast<std::int64_t>(reference + hour - ago)}}};
  }

  // Set-up: before the words are shared.
  void reset() noexcept {
    // relaxed, all: the submission of the queue pair publishes them
    checked_in_ns_.store(0, std::memory_order_relaxed);
    tripped_.store(0, std::memory_order_relaxed);
    acknowledged_.store(0, std::memory_order_relaxed);
  }

 private:
  alignas(rt::line_bytes) typename Atomics::template variable<std::int64_t> checked_in_ns_{0};
  typename Atomics::template variable<latch_number> tripped_{0};
  typename Atomics::template variable<std::uint64_t> acknowledged_{0};
};

// What only the loop itself knows.
struct latch_memory {
  latch_number tripped = 0;
  latch_number acknowledged = 0;
};

// A loop looks at `now`. True: it must not move. Bounded: one load, one or two stores.
template <class Atomics>
ROWE_RT bool latch_engaged(const permit_word<Atomics>& granted, latch_words<Atomics>& words,
                           latch_memory& own, rt::time_point now) noexcept {
  words.check_in(now);
  const std::uint64_t word = granted.read();
  const latch_number number = permit::number_of(word);
  if (permit::units_of(now) < permit::time_of(word) && number != own.tripped) return false;
  if (own.tripped != number) {
    own.tripped = number;
    words.trip(number);
  }
  return true;
}

// The loop has commanded its brake. Only the first call for each number counts.
template <class Atomics>
ROWE_RT void latch_acknowledge(latch_words<Atomics>& words, latch_memory& own, rt::time_point now) noexcept {
  if (own.acknowledged == own.tripped) return;
  own.acknowledged = own.tripped;
  words.acknowledge(own.tripped, now);
}

} // namespace rowe::detail
