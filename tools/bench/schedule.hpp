// SPDX-License-Identifier: Apache-2.0
// When messages are to be sent: a grid that is laid down before the first one and never moves. A sample is
// measured from its intended time, so what stalls the sender, the peer or the machine is charged to every
// message that it delayed, not only to the one that was on its way.
#pragma once
#include <cmath>
#include <cstdint>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::tools::bench {

class schedule {
 public:
  // `count` times, `period` (above 0) apart, the first at `start`.
  ROWE_RT constexpr schedule(rt::time_point start, rt::duration period, std::uint64_t count) noexcept
      : start_{start}, period_{period}, count_{count} {}

  ROWE_RT constexpr rt::time_point start() const noexcept { return start_; }
  ROWE_RT constexpr rt::duration period() const noexcept { return period_; }
  ROWE_RT constexpr std::uint64_t count() const noexcept { return count_; }
  // Of message `index`, counted from 0; `never` behind the last one.
  ROWE_RT constexpr rt::time_point time_of(std::uint64_t index) const noexcept {
    if (index >= count_) return rt::never;
    return start_ + static_cast<std::int64_t>(index) * period_;
  }
  // How many messages should have been sent by then.
  ROWE_RT constexpr std::uint64_t due_by(rt::time_point now) const noexcept {
    if (now < start_) return 0;
    const auto whole = static_cast<std::uint64_t>((now - start_) / period_) + 1;
    return whole < count_ ? whole : count_;
  }
  // Nothing is intended any more but the first `count`.
  ROWE_RT constexpr void cut(std::uint64_t count) noexcept {
    if (count < count_) count_ = count;
  }

 private:
  rt::time_point start_;
  rt::duration period_;
  std::uint64_t count_;
};

inline rt::duration period_of(double hertz) noexcept { return rt::duration{std::llround(1e9 / hertz)}; }

// How many periods a duration holds; at least one.
constexpr std::uint64_t count_in(rt::duration whole, rt::duration period) noexcept {
  return whole < period ? 1 : static_cast<std::uint64_t>(whole / period);
}

} // namespace rowe::tools::bench
