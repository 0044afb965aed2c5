// SPDX-License-Identifier: Apache-2.0
// How many things a second one peer may do. It is a token bucket of one second, by the virtual scheduling
// algorithm of ITU-T I.371. Pure; service thread only.
#pragma once
#include <algorithm>
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"

namespace rowe::service {

class rate_limit {
 public:
  static constexpr rt::duration burst = std::chrono::seconds{1};

  rate_limit() noexcept = default;
  // 0: no limit. More than 1e9 a second counts as that.
  explicit rate_limit(std::uint32_t per_second) noexcept
      : period_{per_second == 0 ? 0 : std::max<std::int64_t>(1'000'000'000 / per_second, 1)} {}
  // One for each period, after a first burst of so many.
  rate_limit(rt::duration period, std::uint32_t burst_count) noexcept
      : period_{period}, burst_{period * burst_count} {}

  // Takes one at `now`. False: too many.
  bool take(rt::time_point now) noexcept {
    if (period_ == rt::duration{0}) return true;
    const rt::time_point from = std::max(paid_until_, now);
    if (from - now < burst_ / 2) over_since_ = rt::never;
    if (from - now > burst_ - period_) {
      over_since_ = std::min(over_since_, now);
      return false;
    }
    paid_until_ = from + period_;
    return true;
  }
  // For how long there were too many, without a pause of half a burst.
  rt::duration over_for(rt::time_point now) const noexcept {
    return over_since_ == rt::never ? rt::duration{0} : now - over_since_;
  }

 private:
  rt::duration period_{0};
  rt::duration burst_{burst};
  rt::time_point paid_until_{};
  rt::time_point over_since_ = rt::never;
};

// Whether somebody gets a report again: at most once a second. `reported`: when the last one was; zero:
// never.
inline bool may_report_again(rt::time_point& reported, rt::time_point now) noexcept {
  if (reported != rt::time_point{} && now - reported < undecodable_period) return false;
  reported = now;
  return true;
}

} // namespace rowe::service
