// SPDX-License-Identifier: Apache-2.0
// How long a round trip to a peer takes when nothing of ours is queued there: the shortest one seen.
//
// It may become longer. But while messages are held back, every round trip includes our own queue at the
// peer, and a bound that follows those round trips grows with its own queue. So if no round trip was as short
// as the shortest for ten seconds of this, nothing is written until all is read. Then a lone ping measures
// the round trip without a queue. If its answer is a little late for a low round-trip time, up to two more
// are asked, because other load delays single answers. They are asked too if the round trip was short before,
// however late the answer is.
//
// Pure: no clock, no socket. For credit, which asks before it writes.
#pragma once
#include <algorithm>
#include <cstdint>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::service {

class round_trip {
 public:
  static constexpr rt::duration low_below = std::chrono::milliseconds{2};
  static constexpr rt::duration window = std::chrono::seconds{10};
  static constexpr rt::duration first_window = std::chrono::seconds{1};
  static constexpr rt::duration little_late_below = 5 * low_below;
  static constexpr std::uint8_t lone_pings_max = 3;

  bool known() const noexcept { return shortest_ != rt::for_ever; }
  bool low() const noexcept { return shortest_ < low_below; }
  rt::duration shortest() const noexcept { return shortest_; }
  rt::duration last() const noexcept { return last_; }
  // Nothing but what is urgent may be written, because a round trip without a queue is being measured.
  bool settling() const noexcept { return now_ != phase::steady; }

  // A message was held back because of the bound.
  void limited() noexcept { limited_ = true; }
  // A pong came. `alone`: no other ping is under way.
  void note(rt::duration took, bool alone, rt::time_point now) noexcept {
    const bool first = !known();
    last_ = took;
    confirmed_ = confirmed_ || took <= shortest_;
    shortest_ = std::min(shortest_, took);
    switch (now_) {
    case phase::draining:
      now_ = phase::measuring;
      lone_pings_ = 0;
      lone_shortest_ = rt::for_ever;
      return;
    case phase::measuring:
      lone_shortest_ = std::min(lone_shortest_, took);
      if (may_be_delayed() && ++lone_pings_ < lone_pings_max && !ROWE_MUTANT(lone_pings)) return;
      now_ = phase::steady;
      if (!ROWE_MUTANT(longer_way)) shortest_ = lone_shortest_;
      break;
    case phase::steady:
      if (!first && (now < window_ends_ || !alone)) return;
      if (!limited_ || confirmed_) break;
      now_ = phase::draining;
      return;
    }
    window_ends_ = now + (first ? first_window : window); // the first ping may have waited behind messages
    limited_ = confirmed_ = false;
  }

 private:
  enum class phase : std::uint8_t {
    steady,
    draining,  // nothing but what is urgent is written until a ping behind all of it is answered
    measuring, // nor until lone ones are
  };

  bool may_be_delayed() const noexcept {
    if (lone_shortest_ < low_below) return false;
    return low() || (lone_shortest_ < little_late_below && !ROWE_MUTANT(little_late));
  }

  phase now_ = phase::steady;
  bool limited_ = false;        // in this window
  bool confirmed_ = false;      // in this window: the shortest round trip is as short as it was
  std::uint8_t lone_pings_ = 0; // answered while measuring
  rt::duration last_ = rt::duration{0};
  rt::duration shortest_ = rt::for_ever;
  rt::duration lone_shortest_ = rt::for_ever;
  rt::time_point window_ends_{};
};

} // namespace rowe::service
