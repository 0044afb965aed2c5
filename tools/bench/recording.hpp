// SPDX-License-Identifier: Apache-2.0
// What was measured: how many samples of which size, and when the worst of them were. All memory is taken
// before the run; recording is a bounded number of steps.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/histogram.hpp>

namespace rowe::tools::bench {

// 128 buckets an octave: a percentile is at most 0.8 % too large.
using distribution = rt::inline_histogram<7>;

struct sample {
  rt::duration at{}; // its intended time, counted from the start of the measurement
  rt::duration value{};
};

// One thread records; to be read once it has ended.
class recording {
 public:
  static constexpr std::size_t over_kept_max = 1000;
  static constexpr std::size_t worst_kept_max = 10;

  // `bound`: what is above it is kept with its time; rt::for_ever: nothing is. `ways`: how many of what is
  // shown there are in what is measured: 2 where one way is shown as half of the round trip.
  explicit recording(rt::duration bound = rt::for_ever, int ways = 1)
      : bound_{bound}, ways_{ways}, over_{std::make_unique<std::array<sample, over_kept_max>>()} {}

  // Times are counted from `start`.
  void begin(rt::time_point start) noexcept { start_ = start; }

  // A message that was to be sent at `intended` was there at `done`. Never waits, never allocates; at most
  // `worst_kept_max` steps.
  ROWE_RT void record(rt::time_point intended, rt::time_point done) noexcept {
    const sample one{intended - start_, (done - intended) / ways_};
    times_.record(one.value);
    if (one.value > bound_ && over_count_++ < over_kept_max) (*over_)[over_count_ - 1] = one;
    if (worst_count_ < worst_kept_max || one.value > worst_[worst_count_ - 1].value) keep_worst(one);
  }

  const rt::histogram& times() const noexcept { return times_; }
  rt::duration bound() const noexcept { return bound_; }
  // Samples above the bound: how many, and the first `over_kept_max` of them in their order.
  std::uint64_t over_count() const noexcept { return over_count_; }
  std::span<const sample> over() const noexcept {
    return std::span{*over_}.first(std::min<std::uint64_t>(over_count_, over_kept_max));
  }
  // The largest samples, largest first; of equal ones the earliest.
  std::span<const sample> worst() const noexcept { return std::span{worst_}.first(worst_count_); }

 private:
  ROWE_RT void keep_worst(const sample& one) noexcept {
    if (worst_count_ < worst_kept_max) ++worst_count_;
    std::size_t at = worst_count_ - 1;
    for (; at > 0 && worst_[at - 1].value < one.value; --at) worst_[at] = worst_[at - 1];
    worst_[at] = one;
  }

  rt::duration bound_;
  int ways_;
  rt::time_point start_{};
  distribution times_;
  std::uint64_t over_count_ = 0;
  std::unique_ptr<std::array<sample, over_kept_max>> over_;
  std::size_t worst_count_ = 0;
  std::array<sample, worst_kept_max> worst_{};
};

} // namespace rowe::tools::bench
