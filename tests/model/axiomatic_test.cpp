// SPDX-License-Identifier: Apache-2.0
// The explorer against the text of the standard: for random small programs, the set of all outcomes the
// explorer finds must be the set the axioms allow. One missing outcome would be a bug that the explorer
// cannot see in rowe's structures; one too many would be a false alarm.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "model/axioms.hpp"
#include "model/expect.hpp"
#include "model/program.hpp"

namespace rowe::model {
namespace axiomatic_test {
namespace {

// Two of three are seq_cst: what may go wrong is mostly where they meet the others.
order random_order(operation what, std::mt19937_64& random) {
  if (random() % 3 != 0) return order::seq_cst;
  switch (what) {
  case operation::load: return random() % 2 == 0 ? order::relaxed : order::acquire;
  case operation::store: return random() % 2 == 0 ? order::relaxed : order::release;
  default: return std::array{order::relaxed, order::acquire, order::release, order::acq_rel}[random() % 4];
  }
}

// Values differ, so that an outcome tells which store was read.
program random_program(std::mt19937_64& random, std::size_t threads, std::size_t instructions,
                       std::size_t words) {
  constexpr std::array kinds{operation::load, operation::load, operation::store, operation::store,
                             operation::exchange};
  program p(threads);
  for (std::size_t i = 0; i != instructions; ++i) {
    const operation what = kinds[random() % kinds.size()];
    p[i < threads ? i : random() % threads].push_back(
        {what, random() % words, i + 1, random_order(what, random)});
  }
  return p;
}

// Programs of two or three threads whose operations form a cycle, so that one edge more or less between two
// operations decides whether the last outcome is possible. Their orders are chosen at random each time.
constexpr std::size_t x = 0;
constexpr std::size_t y = 1;
constexpr std::size_t z = 2;
constexpr order any = order::relaxed;
const std::vector<program> circles{
    {{store(x, 1, any), load(y, any)}, {store(y, 1, any), load(x, any)}},
    {{exchange(x, 1, any), load(y, any)}, {exchange(y, 1, any), load(x, any)}},
    {{store(x, 1, any), store(y, 2, any)}, {store(y, 1, any), store(x, 2, any)}},
    {{store(x, 1, any), store(y, 1, any)}, {store(y, 2, any), load(x, any)}},
    {{store(x, 2, any), store(y, 1, any)}, {load(y, any), store(x, 1, any)}},
    {{store(x, 1, any), load(y, any)}, {store(y, 1, any), load(z, any)}, {store(z, 1, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)}, {load(y, any), load(z, any)}, {store(z, 1, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)}, {load(y, any)}, {store(y, 2, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)}, {exchange(y, 2, any)}, {store(y, 3, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)},
     {exchange(y, 2, any), load(z, any)},
     {store(z, 1, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)},
     {exchange(y, 2, any), load(y, any)},
     {store(y, 3, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any)}, {exchange(y, 2, any)}, {load(y, any), load(x, any)}},
    {{store(x, 1, any)}, {load(x, any), load(y, any)}, {store(y, 1, any), load(x, any)}},
    {{store(x, 1, any)}, {load(x, any), store(y, 1, any)}, {load(y, any), load(x, any)}},
    {{store(x, 1, any)}, {store(y, 1, any)}, {load(x, any), load(y, any)}, {load(y, any), load(x, any)}},
    {{store(x, 1, any), store(y, 1, any), store(y, 2, any)}, {load(y, any), load(x, any)}},
};

program with_random_orders(program p, std::mt19937_64& random) {
  for (auto& thread : p) {
    for (instruction& i : thread) i.asks = random_order(i.what, random);
  }
  return p;
}

std::string difference(const program& p) {
  const std::set<outcome> explored = explored_outcomes(p);
  const std::set<outcome> allowed = axiomatic{p}.outcomes();
  std::string text;
  for (const outcome& o : allowed) {
    if (!explored.contains(o)) text += "never explored: " + text_of(o) + "\n";
  }
  for (const outcome& o : explored) {
    if (!allowed.contains(o)) text += "not allowed: " + text_of(o) + "\n";
  }
  return text.empty() ? text : text + text_of(p);
}

void expect_same_outcomes(std::uint64_t usual_seed, int programs, std::size_t threads,
                          std::size_t instructions, std::size_t words) {
  const std::uint64_t seed = seed_or(usual_seed);
  std::mt19937_64 random{seed};
  for (int n = 0; n != programs; ++n) {
    ASSERT_EQ(difference(random_program(random, threads, instructions, words)), "")
        << "ROWE_SEED=" << seed << ", program " << n;
  }
}

TEST(explorer, finds_the_outcomes_the_axioms_allow_whatever_orders_circular_programs_have) {
  const std::uint64_t seed = seed_or(5);
  std::mt19937_64 random{seed};
  for (std::size_t c = 0; c != circles.size(); ++c) {
    for (int n = 0; n != 100; ++n) {
      ASSERT_EQ(difference(with_random_orders(circles[c], random)), "")
          << "ROWE_SEED=" << seed << ", circle " << c;
    }
  }
}

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_two_threads) { expect_same_outcomes(1, 400, 2, 6, 2); }

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_three_threads) {
  expect_same_outcomes(2, 300, 3, 6, 2);
}

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_three_words) { expect_same_outcomes(3, 100, 3, 7, 3); }

TEST(explorer, finds_the_outcomes_the_axioms_allow_for_four_threads) {
  expect_same_outcomes(4, 100, 4, 6, 2);
}

} // namespace
} // namespace axiomatic_test
} // namespace rowe::model
