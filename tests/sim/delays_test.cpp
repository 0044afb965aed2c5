// SPDX-License-Identifier: Apache-2.0
// Messages of the core over a link on which TCP loses segments, as recorded.
#include <gtest/gtest.h>

#include <iostream>
#include <optional>

#include "delays.hpp"
#include "service/core/core_harness.hpp"

namespace delays_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;

struct beat {
  std::int64_t n;
};

} // namespace
} // namespace delays_test

template <>
inline constexpr auto rowe::schema<delays_test::beat> = rowe::fields<&delays_test::beat::n>{};

namespace delays_test {
namespace {

std::int64_t number_in(std::string_view text) {
  const auto at = text.find("\"n\":");
  return at == std::string_view::npos ? -1 : std::strtoll(text.data() + at + 4, nullptr, 10);
}

// Numbers that must come one after the other, and how far apart in time they come at most.
struct arrivals {
  void take(std::int64_t n, time_point now) {
    if (n != count) ++wrong;
    if (count++ > 0) gap_max = std::max(gap_max, now - last);
    last = now;
  }
  std::int64_t count = 0, wrong = 0;
  time_point last{};
  duration gap_max{};
};

double ms(duration of) { return std::chrono::duration<double, std::milli>(of).count(); }

TEST(delays, are_those_of_the_trace_for_messages_as_far_apart) {
  const sim::trace recorded{.period = 20ms, .taken = {2ms, 62ms, 42ms, 22ms, 3ms, 2ms}};
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    sim::delays line{recorded, seed};
    time_point now{1000s}, last{};
    std::optional<std::size_t> at; // where in the trace we are
    for (int i = 0; i < 50; ++i, now += 20ms) {
      const time_point arrival = line.next(now);
      ASSERT_GE(arrival, last) << "seed " << seed;
      ASSERT_GE(arrival, now + 2ms);
      // 62 ms is only one message's delay, so that there one knows.
      if (at && *at + 1 < recorded.taken.size()) {
        at = *at + 1;
        ASSERT_EQ(arrival, std::max(last, now + recorded.taken[*at])) << "seed " << seed;
      } else {
        at = arrival == now + 62ms ? std::optional<std::size_t>{1} : std::nullopt;
      }
      last = arrival;
    }
  }
}

TEST(delays, begin_where_the_seed_says) {
  const sim::trace recorded = sim::trace::read("robot_20ms");
  sim::delays first{recorded, 1}, same{recorded, 1}, other{recorded, 2};
  bool differs = false;
  for (time_point now{1000s}; now < time_point{1010s}; now += 7ms) {
    const time_point arrival = first.next(now);
    ASSERT_EQ(arrival, same.next(now));
    differs = differs || arrival != other.next(now);
  }
  EXPECT_TRUE(differs);
}

// An hour of heartbeats every 50 ms to us, and of ticks every 20 ms from us, at 3 % loss each way. How large
// the gaps are is reported: it is the network's matter, not the core's.
TEST(delays, let_all_messages_of_an_hour_through_in_order) {
  const sim::trace ticks = sim::trace::read("robot_20ms");
  const sim::trace beats = sim::trace::read("guard_50ms");
  ASSERT_EQ(ticks.period, 20ms);
  ASSERT_EQ(beats.period, 50ms);

  harness::core_harness on;
  rowe::publisher<beat> out{harness::core_harness::handle_of(
      on.offer(rowe::detail::advertise_request<beat>("/tick", {.keep = rowe::keep::all})))};
  rowe::subscriber<beat> in{
      harness::core_harness::handle_of(on.offer(rowe::detail::subscribe_request<beat>("/beat", {})))};
  harness::peer guard{on};
  guard.say(R"({"op":"subscribe","topic":"/tick"})");
  on.cycle();
  on.net.link_of(guard.id()).to_peer = sim::delays{ticks, 1};
  on.net.link_of(guard.id()).to_us = sim::delays{beats, 2};

  arrivals at_guard, at_us;
  std::int64_t published = 0, said = 0;
  const time_point begin = on.now;
  for (time_point last = begin + 1h; on.now < last || at_us.count < said || at_guard.count < published;) {
    if (on.now < last && (on.now - begin) % 20ms == 0ns) {
      ASSERT_TRUE(out.publish({published++}, on.now));
    }
    if (on.now < last && (on.now - begin) % 50ms == 0ns) {
      guard.say(R"({"op":"publish","topic":"/beat","msg":{"n":)" + std::to_string(said++) + "}}");
    }
    on.cycle(1ms);
    while (auto came = in.try_take()) at_us.take(came->value().n, on.now);
    for (const std::string& text : guard.hear()) at_guard.take(number_in(text), on.now);
    ASSERT_LT(on.now, last + 1min) << at_us.count << " of " << said << ", " << at_guard.count << " of "
                                   << published;
  }
  EXPECT_EQ(at_us.wrong + at_guard.wrong, 0);
  EXPECT_EQ(at_us.count, 72'000);
  EXPECT_EQ(at_guard.count, 180'000);
  std::cout << "largest gap: " << ms(at_us.gap_max) << " ms between heartbeats every 50 ms, "
            << ms(at_guard.gap_max) << " ms between ticks every 20 ms\n";
}

} // namespace
} // namespace delays_test
