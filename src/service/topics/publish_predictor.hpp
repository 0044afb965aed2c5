// SPDX-License-Identifier: Apache-2.0
// idle::phase: the service thread predicts when values come, and sleeps until shortly before.
//
// A publisher declares its period; every value carries its publish time. So the next value is due a period
// after the last one. Only two things are learned. One is how far values spread around their due times: the
// first to the last percentile of the last 64, around a line, since clocks drift. The other is how long after
// its stamp a value arrives, since a loop may compute between the two. Shortly before a value is due the
// service thread opens a spin window: it polls without waiting until the value has arrived. Else it sleeps
// longer than other policies may.
//
//   learning -> (8 values in a row, each a period after the one before) -> planned
//   planned  -> (3 in a row outside their window, or not at all)        -> learning, which is polled
//
// Answers are predicted, too: the thread that is given a request may have waited for it, and answer at once.
// So the service thread spins for the answer, for 100 us at most, unless the last three took longer.
//
// Spinning has a budget of 8 ms in any 100 ms. Topics of lower priority leave a part of it to the others. A
// value without a window is polled for until it has arrived.
//
// Time is passed in. Service thread only. docs/decisions/0017-predict-publish-times.md has the reasons.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/counters.hpp"
#include "service/base/ids.hpp"

namespace rowe::service {

class publish_predictor {
 public:
  static constexpr unsigned hits_min = 8;   // in a row, then it is planned
  static constexpr unsigned misses_max = 3; // in a row, then it is polled
  static constexpr std::size_t history = 64;
  // The share of time for spinning, and how much may be used ahead: together at most 8 ms in any 100 ms.
  static constexpr int share_percent = 7;
  static constexpr rt::duration ahead_max = std::chrono::milliseconds{1};
  // The longest sleep while values are due: an early value waits no longer than this.
  static constexpr rt::duration rest_max = std::chrono::milliseconds{10};
  static constexpr rt::duration answer_max = std::chrono::microseconds{100};

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  publish_predictor(rt::arena& memory, const limits& bounds, counters& counts) noexcept;

  // A publisher that declared its period is attached; has a listener, or none any more; is detached.
  void begin(pair_index pair, rt::duration period, priority rank) noexcept;
  void listen(pair_index pair, bool somebody) noexcept;
  void end(pair_index pair) noexcept;
  std::uint32_t listened() const noexcept { return listened_; } // how many publishers have a listener

  // The queue pairs are about to be polled; a value stamped `published` was found in one of them.
  void looks(rt::time_point now) noexcept {
    before_ = looked_;
    looked_ = now;
  }
  void saw(pair_index pair, rt::time_point published) noexcept;

  // A request was given to a thread of this process; it was answered at the time `given`.
  void asked(rt::time_point now) noexcept;
  void answered(rt::time_point given) noexcept;

  // Until when to sleep for values that have listeners; not after `now`: do not sleep, but poll.
  rt::time_point wait_until(rt::time_point now, rt::duration poll_period) noexcept;
  // A sleep that was to end at `asked` has ended by itself at `now`.
  void woke(rt::time_point asked, rt::time_point now) noexcept;

 private:
  enum class window : std::uint8_t { closed, open, skipped }; // a spin window
  struct row {
    rt::duration period{}; // 0: none
    priority rank = priority::normal;
    bool listened = false;
    bool planned = false;
    bool timed = false;   // `delay` was measured
    bool fitted = false;  // the next window was computed
    bool overdue = false; // a window has passed since the last value
    bool missed = false;  // and that was counted
    window state = window::closed;
    std::uint8_t streak = 0;                     // learning: values one period apart; planned: misses
    std::uint8_t count = 0;                      // of offsets
    std::uint8_t at = 0;                         // where the next one goes
    rt::duration delay{};                        // from stamp to arrival; until `timed`, an upper bound
    rt::time_point grid{};                       // the newest value's due time, in whole periods
    std::array<std::int64_t, history> offsets{}; // of arrivals from the grid
    rt::duration step{};                         // the real period, by the drift of the offsets
    rt::time_point opens{}, late{}, closes{};    // the next window; 98 of 100 values have arrived by `late`

    rt::duration newest() const noexcept { return rt::duration{offsets[(at + history - 1) % history]}; }
  };

  void learn(row& of, rt::time_point published, rt::duration delay) noexcept;
  void take(row& of, rt::time_point came, bool hit) noexcept;
  void put(row& of, std::int64_t periods, rt::time_point came) noexcept;
  void count_miss(row& of) noexcept;
  void fit(row& of) const noexcept;
  rt::time_point look_for_answer(rt::time_point now) noexcept;
  rt::time_point look_at(row& of, rt::time_point now, rt::time_point poll) noexcept;
  void pass(row& of, rt::time_point now) noexcept;
  bool affords(const row& of, rt::time_point now) const noexcept;
  void pay(rt::time_point now) noexcept;

  rows<pair_index, row> rows_;
  std::span<pair_index> used_;
  std::uint32_t used_count_ = 0;
  std::uint32_t listened_ = 0;
  counters& counts_;
  rt::time_point looked_{}, before_{}; // when the pairs were polled: last, and the time before
  rt::time_point asked_ = rt::never;   // the newest request, until it is answered
  window answer_ = window::closed;
  bool answers_soon_ = true;
  std::uint8_t answers_streak_ = 0; // answers in a row that contradict answers_soon_
  bool spinning_ = false;
  rt::time_point paid_{};
  rt::duration left_ = ahead_max * 100;         // of the budget, a hundredth of a nanosecond each
  std::array<std::int32_t, history> wakings_{}; // how late sleeps ended
  std::uint8_t wakings_at_ = 0;
  rt::duration lead_;
};

} // namespace rowe::service
