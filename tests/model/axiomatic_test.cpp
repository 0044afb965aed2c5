// SPDX-License-Identifier: Apache-2.0
// The explorer against the text of the standard: for random small programs, the set of all outcomes the
// explorer finds must be the set the axioms allow. One missing outcome would be a bug that the explorer
// cannot see in rowe's structures; one too many would be a false alarm.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <random>

#include "model/axioms.hpp"
#include "model/program.hpp"

namespace rowe::model {
namespace {

constexpr std::array load_orders{order::relaxed, order::acquire, order::seq_cst, order::seq_cst};
constexpr std::array store_orders{order::relaxed, order::release, order::seq_cst, order::seq_cst};
constexpr std::array exchange_orders{order::relaxed, order::acquire, order::release, order::acq_rel,
                                     order::seq_cst};

// Values differ, so that an outcome tells which store was read.
instruction random_instruction(std::mt19937_64& dice, std::size_t words, std::uint64_t value) {
  const std::size_t word = dice() % words;
  switch (dice() % 7) {
  case 0:
  case 1:
  case 2: return load(word, load_orders[dice() % load_orders.size()]);
  case 3: return exchange(word, value, exchange_orders[dice() % exchange_orders.size()]);
  default: return store(word, value, store_orders[dice() % store_orders.size()]);
  }
}

program random_program(std::mt19937_64& dice, std::size_t threads, std::size_t instructions,
                       std::size_t words) {
  program p(threads);
  for (std::size_t i = 0; i != instructions; ++i) {
    p[i < threads ? i : dice() % threads].push_back(random_instruction(dice, words, i + 1));
  }
  return p;
}

void expect_same_outcomes(std::uint64_t seed, int programs, std::size_t threads, std::size_t instructions,
                          std::size_t words) {
  if (const char* given = std::getenv("ROWE_SEED")) seed = std::strtoull(given, nullptr, 0);
  std::mt19937_64 dice{seed};
  for (int n = 0; n != programs; ++n) {
    const program p = random_program(dice, threads, instructions, words);
    const std::set<outcome> explored = explored_outcomes(p);
    const std::set<outcome> allowed = axiomatic{p}.outcomes();
    if (explored == allowed) continue;
    for (const outcome& o : allowed) {
      if (!explored.contains(o)) ADD_FAILURE() << "never explored: " << text_of(o);
    }
    for (const outcome& o : explored) {
      if (!allowed.contains(o)) ADD_FAILURE() << "not allowed: " << text_of(o);
    }
    FAIL() << "seed " << seed << ", program " << n << "\n" << text_of(p);
  }
}

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_two_threads) { expect_same_outcomes(1, 400, 2, 6, 2); }

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_three_threads) {
  expect_same_outcomes(2, 400, 3, 6, 2);
}

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_three_words) { expect_same_outcomes(3, 200, 3, 7, 3); }

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_four_threads) {
  expect_same_outcomes(4, 200, 4, 6, 2);
}

} // namespace
} // namespace rowe::model
