// SPDX-License-Identifier: Apache-2.0
// idle::phase: when the service thread need not wait for values, because it knows when they come.
//
// A publisher declares its period; every value carries the time it was published at. So the next value is due
// a period after the last one, and only two things are learned: how far values spread around the times they
// are due (the first to the last percentile of the last 64, around a line, since clocks drift), and how long
// after its stamp a value comes, since a loop may compute between reading its time and publishing. Shortly
// before a value is due the service thread begins to watch: it turns without waiting, until the value has
// come. Elsewhere it sleeps, past the polls that other policies need.
//
//   learning -> (8 values in a row, each a period after the one before) -> planned
//   planned  -> (3 in a row that came outside their watch, or not at all)   -> learning, which is polled
//
// An answer is due, too: the thread a request was handed to may have waited for it. So the service thread
// watches for it, for 100 us at most, unless the last three took longer.
//
// Watching has a budget of 8 ms in any 100 ms. Topics of less priority leave a part of it to the others; a
// value that is not watched for is polled for, until it has come.
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

#include "service/counters.hpp"

namespace rowe::service {

class phase_plan {
 public:
  static constexpr unsigned hits_min = 8;   // in a row: planned
  static constexpr unsigned misses_max = 3; // in a row: polled
  static constexpr std::size_t history = 64;
  // Of the time, and so much of it ahead: together never more than 8 ms in any 100 ms.
  static constexpr int share_percent = 7;
  static constexpr rt::duration ahead_max = std::chrono::milliseconds{1};
  // The longest sleep while values are due: one that comes early waits no longer.
  static constexpr rt::duration rest_max = std::chrono::milliseconds{10};
  static constexpr rt::duration answer_max = std::chrono::microseconds{100};

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  phase_plan(rt::arena& memory, const limits& bounds, counters& counts) noexcept;

  // A publisher came, which declared its period; it is listened to, or not any more; it is gone.
  void begin(std::uint32_t lane, rt::duration period, priority rank) noexcept;
  void listen(std::uint32_t lane, bool somebody) noexcept;
  void end(std::uint32_t lane) noexcept;
  std::uint32_t listened() const noexcept { return listened_; } // how many are

  // The lanes are about to be looked at; a value was found in one of them then, stamped `published`.
  void looks(rt::time_point now) noexcept {
    before_ = looked_;
    looked_ = now;
  }
  void saw(std::uint32_t lane, rt::time_point published) noexcept;

  // A request was handed to a thread of this process; one answered, at the time `given`.
  void asked(rt::time_point now) noexcept;
  void answered(rt::time_point given) noexcept;

  // How to wait for what is listened to: not at all, when that is not after `now`; else so long at most.
  rt::time_point wait_until(rt::time_point now, rt::duration poll_period) noexcept;
  // What was to end then has ended now, by itself.
  void woke(rt::time_point asked, rt::time_point now) noexcept;

 private:
  enum class watch : std::uint8_t { closed, open, skipped };
  struct row {
    rt::duration period{}; // 0: none
    priority rank = priority::normal;
    bool listened = false;
    bool planned = false;
    bool timed = false;   // `delay` is known
    bool fitted = false;  // the next watch is
    bool overdue = false; // a watch has passed since the last value,
    bool missed = false;  // and that was counted
    watch state = watch::closed;
    std::uint8_t streak = 0;                     // learning: values a period apart; planned: misses
    std::uint8_t count = 0;                      // of offsets
    std::uint8_t at = 0;                         // where the next one goes
    rt::duration delay{};                        // from stamp to coming; until that is timed, surely not more
    rt::time_point grid{};                       // whole periods; the newest value's
    std::array<std::int64_t, history> offsets{}; // of the times values came at from the grid
    rt::duration step{};                         // a period as it is, by the drift of these
    rt::time_point opens{}, late{}, closes{};    // the next watch; 98 of 100 values have come by `late`

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

  std::span<row> rows_; // by lane
  std::span<std::uint32_t> used_;
  std::uint32_t used_count_ = 0;
  std::uint32_t listened_ = 0;
  counters& counts_;
  rt::time_point looked_{}, before_{}; // at the lanes: last, and the time before
  rt::time_point asked_ = rt::never;   // the newest request, until it is answered
  watch answer_ = watch::closed;
  bool answers_soon_ = true;
  std::uint8_t answers_streak_ = 0; // soon: that were not; else: that would have been
  bool watching_ = false;
  rt::time_point paid_{};
  rt::duration left_ = ahead_max * 100;         // of the budget, a hundredth of a nanosecond each
  std::array<std::int32_t, history> wakings_{}; // how late sleeps ended
  std::uint8_t wakings_at_ = 0;
  rt::duration lead_;
};

} // namespace rowe::service
