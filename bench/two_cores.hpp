// SPDX-License-Identifier: Apache-2.0
// What benches of two pinned threads stand on: the other core, the clock and its own cost.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/grants.hpp>
#include <rowe/rt/thread.hpp>

#include "rounds.hpp"

namespace rowe::bench {

using rt::monotonic_clock;

inline int here = 0;  // this thread's core
inline int there = 1; // the other's

// Takes `--here=CPU` and `--there=CPU` out of the arguments; without them they are two that this process may
// use. False: there are not two, which it says.
inline bool choose_cores(const char* bench, int& count, char** arguments) {
  const auto cpus = two_cpus();
  if (!cpus) {
    std::fprintf(stderr, "%s needs two cores\n", bench);
    return false;
  }
  here = number_option(count, arguments, "here", cpus->first);
  there = number_option(count, arguments, "there", cpus->second);
  return true;
}

inline double nanoseconds(rt::duration span) { return static_cast<double>(span.count()); }
inline double nanoseconds_since(rt::time_point begin) { return nanoseconds(monotonic_clock::now() - begin); }

// What timing a single call costs by itself.
inline double clock_cost() {
  std::vector<double> each;
  for (int i = 0; i < 1'001; ++i) each.push_back(nanoseconds_since(monotonic_clock::now()));
  return median(each);
}

// "loop: pinned to cpu 0, SCHED_FIFO 80", once: what a thread was granted is in every figure.
inline void say_grants(const char* whose, const rt::grants& given) {
  std::array<char, 256> buffer;
  const std::string_view text = given.text(buffer);
  std::printf("%s: %.*s\n", whose, static_cast<int>(text.size()), text.data());
}

// Runs `function` on the other core; begins when that thread runs there.
template <class Function>
rt::thread on_the_other_core(Function function) {
  return rt::thread{rt::thread_options{.name = "partner", .cpu = there}, std::move(function)};
}

// One transfer of a cache line, nanoseconds: half of a word's way there and back.
inline double line_cost() {
  constexpr std::uint64_t trips = 2'000;
  alignas(rt::line_bytes) static std::atomic<std::uint64_t> word;
  word.store(0);
  const rt::thread partner = on_the_other_core([] {
    for (std::uint64_t trip = 0; trip < trips; ++trip) {
      while (word.load(std::memory_order_acquire) != 2 * trip + 1) continue; // pairs with the release below
      word.store(2 * trip + 2, std::memory_order_release);                   // pairs with the acquire below
    }
  });
  std::vector<double> each;
  for (std::uint64_t trip = 0; trip < trips; ++trip) {
    const auto begin = monotonic_clock::now();
    word.store(2 * trip + 1, std::memory_order_release);                   // pairs with the acquire above
    while (word.load(std::memory_order_acquire) != 2 * trip + 2) continue; // pairs with the release above
    each.push_back(nanoseconds_since(begin));
  }
  return std::max(median(each) - clock_cost(), 1.0) / 2;
}

} // namespace rowe::bench
