// SPDX-License-Identifier: Apache-2.0
// The explorer against the text of the standard: for random small programs, the set of all outcomes the
// explorer finds must be the set the axioms allow. One missing outcome would be a bug that the explorer
// cannot see in rowe's structures; one too many would be a false alarm. And the axioms against what everybody
// knows: the tests that each description of a memory model begins with, decided by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <utility>
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

constexpr order relaxed = order::relaxed;
constexpr order acquire = order::acquire;
constexpr order release = order::release;
constexpr order acq_rel = order::acq_rel;
constexpr order seq_cst = order::seq_cst;

program store_buffering(order stores, order loads) {
  return {{store(x, 1, stores), load(y, loads)}, {store(y, 1, stores), load(x, loads)}};
}
program exchange_buffering(order exchanges, order loads) {
  return {{exchange(x, 1, exchanges), load(y, loads)}, {exchange(y, 1, exchanges), load(x, loads)}};
}
program message_passing(order stores, order loads, order data = relaxed) {
  return {{store(x, 1, data), store(y, 1, stores)}, {load(y, loads), load(x, data)}};
}
program independent_reads(order stores, order loads) { // IRIW
  return {{store(x, 1, stores)},
          {store(y, 1, stores)},
          {load(x, loads), load(y, loads)},
          {load(y, loads), load(x, loads)}};
}
program crossed_writes(order first, order second) { // 2+2W, and what is left of both
  return {{store(x, 1, first), store(y, 2, second)}, {store(y, 1, first), store(x, 2, second)}};
}
program causality(order stores, order loads) { // WRC
  return {{store(x, 1, stores)}, {load(x, loads), store(y, 1, stores)}, {load(y, loads), load(x, relaxed)}};
}
program release_sequence(order head, std::vector<instruction> second) {
  return {{store(x, 1, relaxed), store(y, 1, head)}, std::move(second), {load(y, acquire), load(x, relaxed)}};
}

struct litmus {
  program of;
  std::vector<std::uint64_t> reads; // thread by thread
  bool possible;
  std::vector<std::uint64_t> left = {}; // in x and y; none: whatever is
};

TEST(axioms, decide_the_classic_litmus_tests_as_the_standard_does) {
  const program two_loads{{store(x, 1, relaxed), store(x, 2, relaxed)}, {load(x, relaxed), load(x, relaxed)}};
  const program own_store{{store(x, 1, relaxed), load(x, relaxed)}, {store(x, 2, relaxed)}};
  const program read_and_store{{load(x, relaxed), store(x, 1, relaxed)}, {store(x, 2, relaxed)}};
  const program exchanges{{exchange(x, 1, relaxed)}, {exchange(x, 2, relaxed)}, {store(x, 3, relaxed)}};
  const program chain{{store(x, 1, relaxed), exchange(y, 1, release)},
                      {exchange(y, 2, release)},
                      {exchange(y, 3, acquire), load(x, relaxed)}};
  const program readers{{store(x, 1, relaxed)},
                        {store(x, 2, relaxed)},
                        {load(x, relaxed), load(x, relaxed)},
                        {load(x, relaxed), load(x, relaxed)}};
  const std::vector<instruction> by_exchange{exchange(y, 2, relaxed)};
  const std::vector<instruction> by_store{load(y, relaxed), store(y, 2, relaxed)};
  const program own_sequence{{store(x, 1, relaxed), store(y, 1, release), store(y, 2, relaxed)},
                             {load(y, acquire), load(x, relaxed)}};
  // Since C++20; an explorer with a global clock for seq_cst would miss it.
  const program mixed{{store(x, 1, seq_cst), store(y, 1, release)},
                      {exchange(y, 2, seq_cst), load(y, relaxed)},
                      {store(y, 3, seq_cst), load(x, seq_cst)}};
  // C++ and ARM allow {1, 1} here. explorer.hpp says why rowe's structures do not depend on it.
  const program load_buffering{{load(x, relaxed), store(y, 1, relaxed)},
                               {load(y, relaxed), store(x, 1, relaxed)}};
  const litmus all[] = {
      {store_buffering(release, acquire), {0, 0}, true},
      {store_buffering(seq_cst, acquire), {0, 0}, true},
      {store_buffering(release, seq_cst), {0, 0}, true},
      {store_buffering(seq_cst, seq_cst), {0, 0}, false},
      {store_buffering(seq_cst, seq_cst), {0, 1}, true},
      {exchange_buffering(acq_rel, seq_cst), {0, 0, 0, 0}, true},
      {exchange_buffering(seq_cst, seq_cst), {0, 0, 0, 0}, false},
      {message_passing(release, relaxed), {1, 0}, true},
      {message_passing(relaxed, acquire), {1, 0}, true},
      {message_passing(relaxed, relaxed, seq_cst), {1, 0}, true},
      {message_passing(release, acquire), {1, 0}, false},
      {message_passing(release, acquire), {0, 1}, true},
      {two_loads, {2, 1}, false}, // CoRR
      {two_loads, {0, 2}, true},
      {own_store, {0}, false}, // CoWR
      {own_store, {2}, true},
      {read_and_store, {2}, false, {2, 0}}, // CoRW
      {read_and_store, {2}, true, {1, 0}},
      {exchanges, {0, 0}, false},
      {exchanges, {3, 3}, false},
      {chain, {0, 1, 2, 0}, false}, // who acquires one of a chain acquires all of it
      {chain, {3, 0, 2, 0}, true},  // the first thread came last
      {exchanges, {0, 1}, true},
      {readers, {1, 2, 2, 1}, false}, // they agree on the order of one word's stores
      {readers, {1, 2, 1, 2}, true},
      {independent_reads(seq_cst, acquire), {1, 0, 1, 0}, true},
      {independent_reads(release, seq_cst), {1, 0, 1, 0}, false}, // since C++20 the loads alone do it
      {crossed_writes(seq_cst, release), {}, true, {1, 1}},
      {crossed_writes(release, seq_cst), {}, true, {1, 1}},
      {crossed_writes(seq_cst, seq_cst), {}, false, {1, 1}},
      {causality(relaxed, relaxed), {1, 1, 0}, true},
      {causality(release, acquire), {1, 1, 0}, false},
      {release_sequence(release, by_exchange), {1, 2, 0}, false},
      {release_sequence(relaxed, by_exchange), {1, 2, 0}, true},
      {release_sequence(release, by_store), {1, 2, 0}, true},
      {own_sequence, {1, 0}, false},
      {own_sequence, {2, 0}, true}, // since C++20
      {mixed, {1, 3, 0}, true},
      {load_buffering, {1, 1}, false},
      {load_buffering, {0, 1}, true},
  };
  for (const litmus& one : all) {
    const std::set<outcome> allowed = axiomatic{one.of}.outcomes();
    const bool found = std::any_of(allowed.begin(), allowed.end(), [&](const outcome& o) {
      return o.reads == one.reads && std::equal(one.left.begin(), one.left.end(), o.last.begin());
    });
    EXPECT_EQ(found, one.possible) << text_of(one.of) << text_of(outcome{one.reads, {}});
    EXPECT_EQ(difference(one.of), "");
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
