// SPDX-License-Identifier: Apache-2.0
// When what was recorded is due. Deadlines are absolute: they are counted from one anchor, a time of the
// recording and when that was, so the pace does not drift. Pure: the time is passed in.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class playback_clock {
 public:
  explicit playback_clock(double rate) noexcept : rate_{rate} {}

  // From here on: this time of the recording is now. Paused it stays so.
  void set(std::int64_t recorded_ns, rt::time_point now) noexcept {
    recorded_ns_ = recorded_ns;
    at_ = now;
  }
  rt::time_point due(std::int64_t recorded_ns) const noexcept {
    const rt::duration since = scaled(recorded_ns - recorded_ns_, 1 / rate_);
    return since < rt::duration::zero() ? at_ + since : rt::deadline_after(at_, since);
  }
  std::int64_t position(rt::time_point now) const noexcept {
    return paused_ ? recorded_ns_ : recorded_ns_ + scaled((now - at_).count(), rate_).count();
  }

  bool paused() const noexcept { return paused_; }
  void pause(rt::time_point now) noexcept {
    set(position(now), now);
    paused_ = true;
  }
  void resume(rt::time_point now) noexcept {
    at_ = now;
    paused_ = false;
  }
  // The pace goes on where it was broken off.
  void shift(rt::duration by) noexcept { at_ += by; }
  // The recording begins again at `from_ns` when `until_ns` is due.
  void begin_lap(std::int64_t from_ns, std::int64_t until_ns) noexcept {
    at_ = due(until_ns);
    recorded_ns_ = from_ns;
  }

  double rate() const noexcept { return rate_; }

 private:
  static rt::duration scaled(std::int64_t ns, double factor) noexcept {
    if (factor == 1.0) return rt::duration{ns};
    const double scaled = static_cast<double>(ns) * factor;
    constexpr double most = 9e18; // below rt::for_ever
    if (scaled >= most) return rt::for_ever;
    return rt::duration{static_cast<std::int64_t>(scaled < -most ? -most : scaled)};
  }

  double rate_;
  std::int64_t recorded_ns_ = 0;
  rt::time_point at_{};
  bool paused_ = false;
};

} // namespace rowe::tools
