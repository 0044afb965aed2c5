// SPDX-License-Identifier: Apache-2.0
// A robot with one loop that obeys its latch, and a guard at the other end of a link. The guard echoes each
// tick when it comes, as a page does, or the newest one at times of its own. Time moves in milliseconds; the
// loop looks at the latch once in each.
#pragma once
#include <cstdlib>
#include <string>
#include <string_view>

#include <rowe/stop_latch.hpp>

#include "service/core/core_harness.hpp"

namespace sim {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;

class guarded {
 public:
  static constexpr duration each_tick{}; // a heartbeat for each

  // When data sent at a time arrives: from the robot, from the guard. None: at once.
  using delivery = std::function<time_point(time_point)>;

  guarded(duration timeout, duration heartbeat, std::uint64_t seed, delivery from_robot = {},
          delivery from_guard = {})
      : on{options_with(timeout), rowe::service::side::server, seed},
        latch_{harness::core_harness::handle_of(on.offer(rowe::detail::latch_request({})))},
        guard_{on},
        heartbeat_{heartbeat} {
    on.cycle(); // the connection is made, and the loop is known
    on.net.link_of(guard_.id()).to_peer = std::move(from_robot);
    on.net.link_of(guard_.id()).to_us = std::move(from_guard);
    guard_.say(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  }

  void step() {
    if (service_lives) {
      on.cycle(1ms);
    } else {
      on.now += 1ms;
    }
    const bool engaged = latch_.engaged(on.now);
    if (engaged) latch_.acknowledge(on.now);
    if (moving && engaged) {
      ++stops;
      stopped_at = on.now;
    }
    moving = !engaged;
    const bool heard = guard_hears && hear();
    if (guard_speaks && (heartbeat_ == each_tick ? heard : on.now >= speaks_next_)) speak();
  }

  harness::core_harness on;
  bool moving = false;
  int stops = 0;           // while it was moving
  time_point stopped_at{}; // the last one
  double age_ms_max = 0;   // of the tick that the guard had echoed last, as the robot shows it while it moves

  bool service_lives = true;
  bool guard_hears = true;
  bool guard_speaks = true;
  bool guard_resets = true; // whenever it is told that the robot is stopped

  harness::peer& guard() { return guard_; }
  // From now on nothing arrives at either end any more.
  void disconnect(bool to_robot, bool to_guard) {
    const delivery never = [](time_point) { return rowe::rt::never; };
    if (to_robot) on.net.link_of(guard_.id()).to_us = never;
    if (to_guard) on.net.link_of(guard_.id()).to_peer = never;
  }

 private:
  static rowe::endpoint_options options_with(duration timeout) {
    rowe::endpoint_options options = harness::small_options();
    options.stop.guard_timeout = timeout;
    return options;
  }

  static double number_after(std::string_view text, std::string_view key) {
    const auto at = text.find(key);
    return at == std::string_view::npos ? -1 : std::strtod(text.data() + at + key.size(), nullptr);
  }

  // Whether there was a tick.
  bool hear() {
    bool heard = false;
    for (const std::string& text : guard_.hear()) {
      const double tick = number_after(text, R"("tick":)");
      if (tick < 0 || text.find("/rowe/stop/state") == std::string::npos) continue;
      heard = true;
      tick_ = static_cast<std::int64_t>(tick);
      number_ = static_cast<std::int64_t>(number_after(text, R"("number":)"));
      stopped_ = text.find(R"("state":"stopped")") != std::string::npos;
      if (!stopped_) age_ms_max = std::max(age_ms_max, number_after(text, R"("age_ms":)"));
    }
    return heard;
  }

  void speak() {
    speaks_next_ = on.now + heartbeat_;
    if (tick_ < 0) return;
    const std::string tick = std::to_string(tick_);
    call("/rowe/stop/guard", R"({"guard":"guard","tick":)" + tick + "}");
    if (guard_resets && stopped_) {
      call("/rowe/stop/reset", R"({"number":)" + std::to_string(number_) + R"(,"tick":)" + tick + "}");
    }
  }

  void call(const std::string& service, const std::string& args) {
    guard_.say(R"({"op":"call_service","service":")" + service + R"(","args":)" + args + "}");
  }

  rowe::stop_latch latch_;
  harness::peer guard_;
  duration heartbeat_;
  time_point speaks_next_{};
  std::int64_t tick_ = -1; // the newest that came
  std::int64_t number_ = -1;
  bool stopped_ = true;
};

} // namespace sim
