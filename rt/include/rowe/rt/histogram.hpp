// SPDX-License-Identifier: Apache-2.0
// How long things took: counts of durations in buckets whose width grows with the value, so that a fixed
// memory holds nanoseconds and a minute with one relative error. Values below 2^p stand for themselves; from
// there on every octave is cut into 2^p buckets, so that a bucket is never wider than value / 2^p (the
// log-linear scheme that HdrHistogram made known).
//
// One thread records: a handful of additions. Any thread may read at the same time; what it sees then is a
// little older in some buckets than in others, and never torn.
#pragma once
#include <array>
#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/counter.hpp>

namespace rowe::rt {

// Counts in memory that the caller provides and that outlives the histogram. Not copied and not moved: a
// reader elsewhere may hold it. `inline_histogram` below brings its own memory.
class histogram {
 public:
  // One minute in nanoseconds. Larger values count as this one and are counted again by saturated().
  static constexpr std::int64_t value_max = 60'000'000'000;
  static constexpr unsigned precision_bits_min = 1;
  static constexpr unsigned precision_bits_max = 12;

  // How many counters a precision needs: 5 bits (an error of at most 1/32, 3.2 %) take 1,016, that is 8 KiB;
  // 7 bits (0.8 %) take 3,808.
  static constexpr std::size_t counters_needed(unsigned precision_bits) noexcept {
    return index_of(static_cast<std::uint64_t>(value_max), precision_bits) + 1;
  }

  // `counters` must be counters_needed(precision_bits) long; all counts begin at zero. Set-up.
  histogram(std::span<counter> counters, unsigned precision_bits) noexcept
      : counters_{counters}, precision_bits_{precision_bits} {
    assert(precision_bits >= precision_bits_min && precision_bits <= precision_bits_max);
    assert(counters.size() == counters_needed(precision_bits));
    clear();
  }
  histogram(const histogram&) = delete;
  histogram& operator=(const histogram&) = delete;

  // The recording thread. Counts one duration; a negative one counts as 0. Never waits, never allocates.
  ROWE_RT void record(duration value) noexcept { record(value, 1); }
  // The same, `times` times at once.
  ROWE_RT void record(duration value, std::uint64_t times) noexcept {
    const std::uint64_t ns = value.count() > 0 ? static_cast<std::uint64_t>(value.count()) : 0;
    const auto top = static_cast<std::uint64_t>(value_max);
    const std::uint64_t counted = ns < top ? ns : top;
    if (ns > top) saturated_.add(times);
    counters_[index_of(counted, precision_bits_)].add(times);
    count_.add(times);
    sum_.add(counted * times);
    if (ns < min_.get()) min_.set(ns);
    if (ns > max_.get()) max_.set(ns);
  }
  // The recording thread. Forgets everything; readers may see it half done.
  ROWE_RT void clear() noexcept;
  // The recording thread of this histogram; the other one may be recorded into meanwhile. Adds its counts to
  // ours. False, and nothing is added, when the precisions differ.
  ROWE_RT [[nodiscard]] bool add(const histogram& other) noexcept;

  // Any thread, never waits; all of them are 0 while nothing is recorded. The extremes are exact, above
  // value_max too; the mean is exact but for rounding down, and takes what is above value_max as value_max.
  ROWE_RT std::uint64_t count() const noexcept { return count_.get(); }
  ROWE_RT duration(min)() const noexcept {
    const std::uint64_t least = min_.get(), greatest = max_.get();
    return duration{signed_of(least < greatest ? least : greatest)};
  }
  ROWE_RT duration(max)() const noexcept { return duration{signed_of(max_.get())}; }
  ROWE_RT duration mean() const noexcept {
    const std::uint64_t n = count();
    return duration{n == 0 ? 0 : signed_of(sum_.get() / n)};
  }
  // How many were recorded above value_max.
  ROWE_RT std::uint64_t saturated() const noexcept { return saturated_.get(); }
  // The value that `percent` (0 to 100) of the recorded ones do not exceed: the upper end of its bucket,
  // hence never too small and at most value / 2^precision_bits too large; and never above max(). Looks at
  // every counter.
  ROWE_RT duration percentile(double percent) const noexcept;
  // The same for each of `percents`, which do not fall, while it looks at every counter once. `into` is as
  // long.
  ROWE_RT void percentiles(std::span<const double> percents, std::span<duration> into) const noexcept;
  ROWE_RT unsigned precision_bits() const noexcept { return precision_bits_; }
  ROWE_RT std::span<const counter> counters() const noexcept { return counters_; }

  // Which counter a value belongs to, and the values of a counter: from lowest_of to highest_of, both
  // included.
  ROWE_RT static constexpr std::size_t index_of(std::uint64_t value, unsigned precision_bits) noexcept {
    const auto width = static_cast<unsigned>(std::bit_width(value));
    const unsigned shift = width > precision_bits ? width - 1 - precision_bits : 0; // of the value's octave
    // In octave `shift` the shifted value runs from 2^p to 2^(p+1) - 1, so each octave goes on where the one
    // before it ended; below 2^(p+1) the shift is 0 and the value is its own index.
    return (std::size_t{shift} << precision_bits) + (value >> shift);
  }
  ROWE_RT static constexpr std::uint64_t lowest_of(std::size_t index, unsigned precision_bits) noexcept {
    const std::size_t octave = index >> precision_bits;
    if (octave < 2) return index;
    const std::size_t shift = octave - 1;
    return std::uint64_t{index - (shift << precision_bits)} << shift;
  }
  ROWE_RT static constexpr std::uint64_t highest_of(std::size_t index, unsigned precision_bits) noexcept {
    return lowest_of(index + 1, precision_bits) - 1;
  }

  // ---- Text; not for real-time threads ----

  // The percentile distribution as HdrHistogram writes it (`.hgrm`, which its plotter reads), values divided
  // by `unit`. The sink is called with consecutive pieces, each whole lines: void(std::string_view).
  template <std::invocable<std::string_view> Sink>
  void write_percentiles(Sink&& sink, duration unit = std::chrono::microseconds{1}) const {
    write_percentiles(piece_of<Sink>, &sink, unit);
  }
  // A bar for each octave between min and max, with count and share, below a line that says so; bars and
  // values on logarithmic scales, so that one late cycle in a million is seen.
  template <std::invocable<std::string_view> Sink>
  void write_bars(Sink&& sink) const {
    write_bars(piece_of<Sink>, &sink);
  }

 private:
  using put = void (*)(void* sink, std::string_view piece);
  template <class Sink>
  static void piece_of(void* sink, std::string_view piece) {
    (*static_cast<std::remove_reference_t<Sink>*>(sink))(piece);
  }
  void write_percentiles(put write, void* sink, duration unit) const;
  void write_bars(put write, void* sink) const;
  double highest_within(std::size_t index) const noexcept; // of a counter's values, none above max()
  struct moments {
    double mean_ns = 0;
    double deviation_ns = 0;
  };
  moments mean_and_deviation() const noexcept;
  static constexpr std::int64_t signed_of(std::uint64_t value) noexcept {
    return static_cast<std::int64_t>(value);
  }

  std::span<counter> counters_;
  unsigned precision_bits_;
  counter count_, sum_, saturated_, max_, min_;
};

namespace detail {
template <unsigned PrecisionBits>
struct histogram_memory {
  std::array<counter, histogram::counters_needed(PrecisionBits)> counters;
};
} // namespace detail

// A histogram with its memory inside.
template <unsigned PrecisionBits = 5>
class inline_histogram : private detail::histogram_memory<PrecisionBits>, public histogram {
 public:
  inline_histogram() noexcept
      : histogram{this->detail::histogram_memory<PrecisionBits>::counters, PrecisionBits} {}
};

} // namespace rowe::rt
