// SPDX-License-Identifier: Apache-2.0
// Only silence stops the robot: a robot and its guard, on links with recorded delays.
#include <gtest/gtest.h>

#include <array>
#include <iostream>

#include "delays.hpp"
#include "guarded.hpp"
#include "rt/asked.hpp"

namespace stop_silence_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;
using sim::guarded;

constexpr duration guard_timeout = 500ms; // the default
constexpr duration service_timeout = rowe::service_timeout_default(false);
static_assert(guard_timeout == rowe::stop_options{}.guard_timeout);

// One; ROWE_SIM_SEEDS asks for more, one for each 500.
const std::uint64_t hours = 1 + rowe::tests::asked_of("ROWE_SIM_SEEDS", 0) / 500;

double ms(duration of) { return std::chrono::duration<double, std::milli>(of).count(); }

// Ticks and heartbeats every 20 ms at 3 % loss each way. The tail depends on how soon TCP retransmits: it
// waits 200 ms at least unless it is told otherwise.
struct lossy_link {
  explicit lossy_link(const std::string& tcp = {})
      : ticks{sim::trace::read("robot_20ms" + tcp)}, echoes{sim::trace::read("guard_20ms" + tcp)} {}

  guarded robot(duration timeout, duration heartbeat, std::uint64_t seed) const {
    const sim::trace& beats = heartbeat == guarded::each_tick ? echoes : slow_beats;
    return guarded{timeout, heartbeat, seed, sim::delays{ticks, seed}, sim::delays{beats, ~seed}};
  }

  sim::trace ticks, echoes, slow_beats = sim::trace::read("guard_50ms");
};

// How often a robot stops in an hour in which its guard was there all the time.
int stops_in_an_hour(const lossy_link& link, duration timeout, duration heartbeat, std::uint64_t seed) {
  guarded robot = link.robot(timeout, heartbeat, seed);
  while (!robot.moving && robot.on.now < time_point{1010s}) robot.step();
  EXPECT_TRUE(robot.moving);
  for (const time_point end = robot.on.now + 1h; robot.on.now < end;) robot.step();
  EXPECT_TRUE(robot.moving || robot.on.now - robot.stopped_at < 5s); // it is always reset again
  std::cout << "timeout " << ms(timeout) << " ms, heartbeat "
            << (heartbeat == guarded::each_tick ? "for each tick" : "every 50 ms") << ", seed " << seed
            << ": " << robot.stops << " stops; the newest echoed tick was " << robot.age_ms_max
            << " ms old at most\n";
  return robot.stops;
}

TEST(stop_silence, is_not_what_three_percent_of_loss_is_taken_for_where_tcp_repeats_after_20_ms) {
  const lossy_link link{"_rto20"};
  for (std::uint64_t seed = 1; seed <= hours; ++seed)
    EXPECT_EQ(stops_in_an_hour(link, guard_timeout, guarded::each_tick, seed), 0);
}

// A segment that is lost two or three times in a row then delays everything by more than half a second.
TEST(stop_silence, needs_a_timeout_of_a_second_where_tcp_waits_200_ms) {
  const lossy_link link;
  for (std::uint64_t seed = 1; seed <= hours; ++seed) {
    EXPECT_EQ(stops_in_an_hour(link, 1s, guarded::each_tick, seed), 0);
    EXPECT_GT(stops_in_an_hour(link, guard_timeout, guarded::each_tick, seed), 0);
    EXPECT_GT(stops_in_an_hour(link, guard_timeout, 50ms, seed), 0);
  }
}

enum class fate {
  says_nothing_more,     // the program hangs, and still reads
  is_stopped,            // SIGSTOP: neither reads nor writes
  vanishes,              // a black hole both ways; half-open, since nobody is told
  is_not_heard_any_more, // a black hole towards the robot
  hears_nothing_more,    // a black hole towards the guard, which echoes what it heard last, over and over
  closes,                // SIGKILL: its kernel ends the connection
  resets,
  service_thread_dies, // the robot's own
};
constexpr std::array<const char*, 8> names{
    "says nothing more",  "is stopped", "vanishes", "is not heard any more",
    "hears nothing more", "closes",     "resets",   "service thread dies"};

void befall(guarded& robot, fate what) {
  switch (what) {
  case fate::says_nothing_more: robot.guard_speaks = false; break;
  case fate::is_stopped: robot.guard_speaks = robot.guard_hears = false; break;
  case fate::vanishes: robot.disconnect(true, true); break;
  case fate::is_not_heard_any_more: robot.disconnect(true, false); break;
  case fate::hears_nothing_more: robot.disconnect(false, true); break;
  case fate::closes:
  case fate::resets:
    robot.guard_speaks = robot.guard_hears = false;
    robot.guard().leave(what == fate::closes ? rowe::service::close_cause::peer
                                             : rowe::service::close_cause::reset);
    break;
  case fate::service_thread_dies: robot.service_lives = false; break;
  }
}

TEST(stop_silence, stops_within_the_timeout_however_the_guard_goes_and_whatever_still_arrives) {
  constexpr std::uint64_t runs = 1000;
  const lossy_link link;
  std::array<duration, names.size()> longest{};
  std::uint64_t stopped = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    sim::random_source random_source{seed};
    const auto what = static_cast<fate>(seed % names.size());
    const duration heartbeat = random_source.one_in(2) ? guarded::each_tick : 50ms;
    guarded robot = random_source.one_in(2) ? link.robot(guard_timeout, heartbeat, seed)
                                            : guarded{guard_timeout, heartbeat, seed};
    for (auto left = random_source.below(1000); left > 0 || !robot.moving; left -= left > 0 ? 1 : 0) {
      robot.step();
      ASSERT_LT(robot.on.now, time_point{1020s});
    }

    robot.guard_resets = false;
    befall(robot, what);
    const time_point since = robot.on.now;
    while (robot.moving && robot.on.now < since + 10s) robot.step();
    ASSERT_FALSE(robot.moving) << "guard " << names[seed % names.size()];
    const duration took = robot.on.now - since;
    EXPECT_LE(took, what == fate::service_thread_dies ? service_timeout + 2ms : guard_timeout + 20ms)
        << "guard " << names[seed % names.size()];
    longest[seed % names.size()] = std::max(longest[seed % names.size()], took);

    // It comes back, with all that was delayed, and nobody resets.
    robot.guard_speaks = robot.guard_hears = true;
    for (int i = 0; i < 700; ++i) {
      robot.step();
      ASSERT_FALSE(robot.moving) << "without a reset, guard " << names[seed % names.size()];
    }
    ++stopped;
  }
  EXPECT_EQ(stopped, runs);
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::cout << names[i] << ": stopped after " << ms(longest[i]) << " ms at most\n";
  }
}

} // namespace
} // namespace stop_silence_test
