// SPDX-License-Identifier: Apache-2.0
// A publisher that saturates the link to one reader, for links of many kinds. The reader is kept busy, and
// urgent messages overtake within the time that docs/limits.md states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "service/core/core_fixtures.hpp"
#include "service/outgoing/credit.hpp"

#include "simulated_link.hpp"

namespace sim {
namespace backlog_sim_test {
namespace {

using rowe::service::credit;

constexpr duration step = 500us;
constexpr std::size_t frame_bytes_max = 1000;

double seconds(duration time) { return std::chrono::duration<double>(time).count(); }

class saturated {
 public:
  saturated(std::uint64_t seed, const simulated_link::properties& is,
            std::size_t text_bytes_max = frame_bytes_max - 100)
      : text_bytes_max_{text_bytes_max},
        random_{seed},
        on_{options(), rowe::service::side::server, seed},
        telemetry_{on_.offer(rowe::detail::pair_kind::publish_text, "/telemetry", text_bytes_max_)},
        alarm_{on_.offer(rowe::detail::pair_kind::publish_text, "/alarm", 8,
                         {.priority = rowe::priority::urgent})},
        link{on_, is} {
    link.peer().say(R"({"op":"subscribe","topic":"/telemetry"})");
    link.peer().say(R"({"op":"subscribe","topic":"/alarm"})");
    link.heard = [this](const written_frame& frame) {
      if (frame.payload.find("/alarm") == std::string::npos) return;
      late = std::max(late, on_.now - alarm_at_);
      alarm_at_ = rowe::rt::never;
    };
    on_.cycle(step);
  }

  // Measures anew.
  void run(duration time) {
    late = {};
    in_flight = 0;
    const auto read = link.bytes_read();
    const auto until = on_.now + time;
    while (on_.now < until) {
      publish();
      on_.cycle(step);
      link.advance();
      in_flight = std::max(in_flight, on_.count(harness::counter::bytes_out) - link.bytes_read());
    }
    rate = static_cast<double>(link.bytes_read() - read) / seconds(time);
    EXPECT_FALSE(link.broken());
    EXPECT_TRUE(on_.core.check());
  }

 private:
  static rowe::endpoint_options options() {
    auto chosen = harness::small_options();
    chosen.limits.small_slots = 512;
    chosen.limits.queue_depth_max = 256;
    chosen.limits.queued_max = 512;
    return chosen;
  }

  void publish() {
    for (int i = 0; i < 16; ++i) {
      const std::string text = R"({"x":")" + std::string(random_.below(text_bytes_max_ - 8), 'x') + "\"}";
      ASSERT_TRUE(harness::publish_text(on_, telemetry_, text));
    }
    if (alarm_at_ != rowe::rt::never || !random_.one_in(40)) return;
    ASSERT_TRUE(harness::publish_text(on_, alarm_, "{}"));
    alarm_at_ = on_.now;
  }

  const std::size_t text_bytes_max_;
  random_source random_;
  harness::core_harness on_;
  rowe::detail::queue_pair& telemetry_;
  rowe::detail::queue_pair& alarm_;
  time_point alarm_at_ = rowe::rt::never;

 public:
  simulated_link link;
  duration late{};             // the latest alarm
  std::uint64_t in_flight = 0; // at most
  double rate = 0;             // bytes a second that were read
};

// How much may be in flight to such a reader. The rate is measured, and time passes in steps, so both have
// noise.
double bound(const simulated_link::properties& is) {
  const double time = seconds(2 * (is.round_trip + 2 * step) + credit::queue_time_high_rtt);
  return std::clamp(1.3 * is.bytes_per_second * time, double{credit::bytes_min}, double{credit::bytes_max});
}

void expect_kept(saturated& all) {
  const simulated_link::properties& is = all.link.is();
  const double most = bound(is) + credit::bytes_min + 2 * frame_bytes_max; // urgent ones, and one begun
  EXPECT_LE(static_cast<double>(all.in_flight), most);
  EXPECT_LE(seconds(all.late), most / is.bytes_per_second + seconds(is.round_trip + 4 * step));
  const double possible = std::min(is.bytes_per_second, credit::bytes_max / 2 / seconds(is.round_trip));
  EXPECT_GE(all.rate, 0.8 * possible);
}

TEST(backlog_sim, bounds_what_is_in_flight_in_time_and_keeps_the_reader_busy) {
  for (const duration round_trip : {1ms, 20ms, 200ms}) {
    for (const double rate : {20e3, 2e6}) {
      SCOPED_TRACE(std::to_string(round_trip / 1ms) + " ms, " + std::to_string(rate) + " B/s");
      saturated all{1, {.round_trip = round_trip, .bytes_per_second = rate}};
      all.run(6s);
      all.run(6s);
      expect_kept(all);
    }
  }
}

TEST(backlog_sim, follows_a_reader_that_becomes_slower_or_faster_and_a_way_that_becomes_longer) {
  random_source random{7};
  for (int seed = 1; seed <= 2; ++seed) {
    saturated all{static_cast<std::uint64_t>(seed), {}};
    for (int change = 0; change < 3; ++change) {
      simulated_link::properties& is = all.link.is();
      is.round_trip = 1ms * (1 + random.below(100));
      is.bytes_per_second = 20e3 * std::pow(100, static_cast<double>(random.below(1000)) / 1000);
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(is.round_trip / 1ms) + " ms, " +
                   std::to_string(is.bytes_per_second) + " B/s");
      all.run(15s);
      all.run(3s);
      expect_kept(all);
    }
  }
}

} // namespace
} // namespace backlog_sim_test
} // namespace sim
