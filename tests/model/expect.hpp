// SPDX-License-Identifier: Apache-2.0
// How the tests of this folder state that a scenario passes: in every run, in every run within the bound on
// preemptions, or in many random runs of something too long for either. ROWE_SEED in the environment replaces
// a seed.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>

#include "model/explorer.hpp"
#include "rt/asked.hpp"

namespace rowe::model {

inline std::uint64_t seed_or(std::uint64_t usual) { return tests::asked_of("ROWE_SEED", usual); }

template <class Scenario>
void expect_passes(const options& o = {}) {
  const report r = explore<Scenario>(o);
  EXPECT_TRUE(r.passed) << r.text();
  std::printf("  %llu runs\n", static_cast<unsigned long long>(r.runs));
}

// With no bound on preemptions: what is small enough is explored whole.
template <class Scenario>
void expect_passes_in_every_interleaving() {
  options unbounded;
  unbounded.preemptions_max = steps_max;
  expect_passes<Scenario>(unbounded);
}

// Two changes of thread where the running one could go on: of three threads that is enough to catch what can
// be caught here.
template <class Scenario>
report explore_two(options o) {
  o.preemptions_max = 2;
  return explore<Scenario>(o);
}

template <class Scenario>
void expect_passes_at_random(std::uint64_t usual_seed, std::uint64_t runs) {
  options random;
  random.seed = seed_or(usual_seed);
  random.runs_max = runs;
  random.preemptions_max = steps_max;
  std::printf("  ROWE_SEED=%llu\n", static_cast<unsigned long long>(*random.seed));
  expect_passes<Scenario>(random);
}

} // namespace rowe::model
