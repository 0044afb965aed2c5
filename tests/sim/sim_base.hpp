// SPDX-License-Identifier: Apache-2.0
// The base of every simulated world: one core in its harness, random numbers from one seed, and a network
// whose link conditions change. Time moves in small steps, and sometimes jumps. The base keeps the first
// error, and a hash of all that happened, so that two runs of one seed can be compared.
#pragma once
#include <cstdint>
#include <random>
#include <string>

#include "service/core/core_harness.hpp"
#include "service/state/topic_table.hpp"

namespace sim {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;

// SplitMix64: as good as a simulation needs, and a seed costs nothing (the state of a Mersenne twister is 312
// words).
class random_source {
 public:
  explicit random_source(std::uint64_t seed) : state_{seed * 0x9e3779b97f4a7c15u} {}

  std::uint64_t operator()() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t below(std::uint64_t bound) { return (*this)() % bound; }
  bool one_in(std::uint64_t n) { return below(n) == 0; }

 private:
  std::uint64_t state_;
};

// Whether the core's structures are compared with each other after this step. That takes half the time of
// many worlds, and those that do not agree seldom do again by themselves. So behind the first thousand seeds,
// in long runs, it is done every fourth time, and at the end.
inline bool looks_inside(std::uint64_t seed, std::uint64_t step) { return seed <= 1000 || step % 4 == 0; }

class sim_base {
 public:
  sim_base(std::uint64_t seed, const rowe::endpoint_options& options, rowe::service::side ours)
      : seed_{seed}, random_{seed}, on_{options, ours, seed} {}

  std::string broken() const {
    if (!looks_inside(seed_, steps_)) return wrong_;
    if (const auto wrong = on_.core.inconsistency(); !wrong.empty())
      return "the core's structures do not agree: " + std::string{wrong};
    return wrong_;
  }
  std::uint64_t trace() const { return trace_; }
  std::uint64_t steps() const { return steps_; }
  harness::core_harness& on() { return on_; }

 protected:
  std::uint64_t below(std::uint64_t bound) { return random_.below(bound); }
  bool one_in(std::uint64_t n) { return random_.one_in(n); }
  void mix(std::uint64_t value) { trace_ = (trace_ ^ value) * 1099511628211u + 0x9e3779b97f4a7c15u; }
  void fail(const std::string& what) {
    if (wrong_.empty()) wrong_ = what + " (step " + std::to_string(steps_) + ")";
  }

  void change_conditions(harness::connection_id of) {
    auto& conditions = on_.net.link_of(of);
    constexpr std::size_t rooms[] = {0, 1, 7, 100, 1000, 20'000, 1'000'000};
    constexpr std::size_t chunks[] = {1, 2, 13, 500, 65536};
    conditions.capacity_bytes = rooms[below(std::size(rooms))];
    conditions.chunk_bytes_max = chunks[below(std::size(chunks))];
    conditions.arrive_bytes_max = one_in(3) ? below(40) : SIZE_MAX;
  }

  void wait(bool jumps) {
    constexpr duration waits[] = {1us, 50us, 500us, 1ms, 5ms, 20ms};
    on_.now += waits[below(std::size(waits))];
    if (jumps && one_in(200)) on_.now += 3s;
  }

  const std::uint64_t seed_;
  random_source random_;
  harness::core_harness on_;
  std::uint64_t steps_ = 0;

 private:
  std::uint64_t trace_ = 14695981039346656037u;
  std::string wrong_;
};

} // namespace sim
