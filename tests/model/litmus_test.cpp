// SPDX-License-Identifier: Apache-2.0
// The explorer's memory, by the tests that every description of a memory model begins with. For each, what
// the orders allow must be found and what they forbid must not: an explorer that finds too little proves
// nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "model/program.hpp"

namespace rowe::model {
namespace litmus_test {
namespace {

constexpr std::size_t x = 0;
constexpr std::size_t y = 1;
constexpr order relaxed = order::relaxed;
constexpr order acquire = order::acquire;
constexpr order release = order::release;
constexpr order acq_rel = order::acq_rel;
constexpr order seq_cst = order::seq_cst;

using values = std::vector<std::uint64_t>;

// Whether some run reads exactly these values, thread by thread.
bool can_read(const program& p, const values& reads) {
  const std::set<outcome> found = explored_outcomes(p);
  EXPECT_FALSE(found.empty());
  return std::any_of(found.begin(), found.end(), [&](const outcome& o) { return o.reads == reads; });
}

// Whether some run leaves these values in x and y.
bool can_leave(const program& p, std::uint64_t in_x, std::uint64_t in_y) {
  const std::set<outcome> found = explored_outcomes(p);
  EXPECT_FALSE(found.empty());
  return std::any_of(found.begin(), found.end(),
                     [&](const outcome& o) { return o.last[x] == in_x && o.last[y] == in_y; });
}

// Each thread stores one word and loads the other.
program store_buffering(order stores, order loads) {
  return {{store(x, 1, stores), load(y, loads)}, {store(y, 1, stores), load(x, loads)}};
}

TEST(litmus, store_buffering_misses_both_stores_unless_all_is_seq_cst) {
  EXPECT_TRUE(can_read(store_buffering(relaxed, relaxed), {0, 0}));
  EXPECT_TRUE(can_read(store_buffering(release, acquire), {0, 0}));
  EXPECT_TRUE(can_read(store_buffering(seq_cst, acquire), {0, 0}));
  EXPECT_TRUE(can_read(store_buffering(release, seq_cst), {0, 0}));
  EXPECT_FALSE(can_read(store_buffering(seq_cst, seq_cst), {0, 0}));
}

TEST(litmus, store_buffering_finds_every_other_outcome_under_any_order) {
  for (const values& reads : {values{0, 1}, values{1, 0}, values{1, 1}}) {
    EXPECT_TRUE(can_read(store_buffering(relaxed, relaxed), reads));
    EXPECT_TRUE(can_read(store_buffering(seq_cst, seq_cst), reads));
  }
}

TEST(litmus, store_buffering_with_exchanges_in_place_of_stores_needs_seq_cst_too) {
  const auto by = [](order exchanges, order loads) {
    return program{{exchange(x, 1, exchanges), load(y, loads)}, {exchange(y, 1, exchanges), load(x, loads)}};
  };
  EXPECT_TRUE(can_read(by(acq_rel, acquire), {0, 0, 0, 0}));
  EXPECT_TRUE(can_read(by(acq_rel, seq_cst), {0, 0, 0, 0}));
  EXPECT_FALSE(can_read(by(seq_cst, seq_cst), {0, 0, 0, 0}));
}

// One thread stores the data and then the flag; the other loads the flag and then the data.
program message_passing(order flag_store, order flag_load, order data = relaxed) {
  return {{store(x, 1, data), store(y, 1, flag_store)}, {load(y, flag_load), load(x, data)}};
}

TEST(litmus, message_passing_shows_the_data_only_by_release_and_acquire) {
  EXPECT_TRUE(can_read(message_passing(relaxed, relaxed), {1, 0}));
  EXPECT_TRUE(can_read(message_passing(release, relaxed), {1, 0}));
  EXPECT_TRUE(can_read(message_passing(relaxed, acquire), {1, 0}));
  EXPECT_FALSE(can_read(message_passing(release, acquire), {1, 0}));
  EXPECT_FALSE(can_read(message_passing(seq_cst, acquire), {1, 0}));
  EXPECT_FALSE(can_read(message_passing(release, seq_cst), {1, 0}));
  EXPECT_FALSE(can_read(message_passing(seq_cst, seq_cst), {1, 0}));
}

TEST(litmus, message_passing_is_not_repaired_by_seq_cst_data) {
  EXPECT_TRUE(can_read(message_passing(relaxed, relaxed, seq_cst), {1, 0}));
}

TEST(litmus, message_passing_may_see_nothing_or_the_data_early) {
  for (const values& reads : {values{0, 0}, values{0, 1}, values{1, 1}}) {
    EXPECT_TRUE(can_read(message_passing(release, acquire), reads));
    EXPECT_TRUE(can_read(message_passing(seq_cst, seq_cst, seq_cst), reads));
  }
}

TEST(litmus, two_loads_of_one_word_never_go_back) { // CoRR
  const program p{{store(x, 1, relaxed), store(x, 2, relaxed)}, {load(x, relaxed), load(x, relaxed)}};
  for (const values& reads : {values{1, 0}, values{2, 0}, values{2, 1}}) EXPECT_FALSE(can_read(p, reads));
  for (const values& reads : {values{0, 0}, values{0, 2}, values{1, 2}, values{2, 2}, values{1, 1}}) {
    EXPECT_TRUE(can_read(p, reads));
  }
}

TEST(litmus, two_readers_agree_on_the_order_of_one_words_stores) {
  const program p{{store(x, 1, relaxed)},
                  {store(x, 2, relaxed)},
                  {load(x, relaxed), load(x, relaxed)},
                  {load(x, relaxed), load(x, relaxed)}};
  EXPECT_TRUE(can_read(p, {1, 2, 1, 2}));
  EXPECT_TRUE(can_read(p, {2, 1, 2, 1}));
  EXPECT_FALSE(can_read(p, {1, 2, 2, 1}));
}

TEST(litmus, a_load_never_reads_behind_its_own_threads_store) { // CoWR
  const program p{{store(x, 1, relaxed), load(x, relaxed)}, {store(x, 2, relaxed)}};
  EXPECT_FALSE(can_read(p, {0}));
  EXPECT_TRUE(can_read(p, {1}));
  EXPECT_TRUE(can_read(p, {2}));
}

TEST(litmus, a_store_lands_behind_what_its_thread_has_read) { // CoRW
  const program p{{load(x, relaxed), store(x, 1, relaxed)}, {store(x, 2, relaxed)}};
  const std::set<outcome> found = explored_outcomes(p);
  EXPECT_FALSE(found.contains({{2}, {2}}));
  EXPECT_TRUE(found.contains({{2}, {1}}));
  EXPECT_TRUE(found.contains({{0}, {2}}));
}

// Two writers of different words, two readers of both in opposite orders.
program independent_reads(order stores, order loads) {
  return {{store(x, 1, stores)},
          {store(y, 1, stores)},
          {load(x, loads), load(y, loads)},
          {load(y, loads), load(x, loads)}};
}

TEST(litmus, independent_readers_may_disagree_unless_their_loads_are_seq_cst) { // IRIW
  EXPECT_TRUE(can_read(independent_reads(relaxed, relaxed), {1, 0, 1, 0}));
  EXPECT_TRUE(can_read(independent_reads(release, acquire), {1, 0, 1, 0}));
  EXPECT_TRUE(can_read(independent_reads(seq_cst, acquire), {1, 0, 1, 0}));
  EXPECT_FALSE(can_read(independent_reads(seq_cst, seq_cst), {1, 0, 1, 0}));
  EXPECT_TRUE(can_read(independent_reads(seq_cst, seq_cst), {1, 1, 1, 0}));
  // Since C++20 the loads alone do it: a load that reads older is before one that reads newer, whoever
  // stored.
  EXPECT_FALSE(can_read(independent_reads(release, seq_cst), {1, 0, 1, 0}));
}

// Each thread stores both words, in opposite orders; may both first stores be the last in modification order?
program two_plus_two_writes(order first, order second) {
  return {{store(x, 1, first), store(y, 2, second)}, {store(y, 1, first), store(x, 2, second)}};
}

TEST(litmus, crossed_writes_may_leave_both_first_stores_unless_all_is_seq_cst) { // 2+2W
  EXPECT_TRUE(can_leave(two_plus_two_writes(relaxed, relaxed), 1, 1));
  EXPECT_TRUE(can_leave(two_plus_two_writes(release, release), 1, 1));
  EXPECT_TRUE(can_leave(two_plus_two_writes(seq_cst, release), 1, 1));
  EXPECT_TRUE(can_leave(two_plus_two_writes(release, seq_cst), 1, 1));
  EXPECT_FALSE(can_leave(two_plus_two_writes(seq_cst, seq_cst), 1, 1));
  EXPECT_TRUE(can_leave(two_plus_two_writes(seq_cst, seq_cst), 2, 2));
  EXPECT_TRUE(can_leave(two_plus_two_writes(seq_cst, seq_cst), 1, 2));
}

TEST(litmus, a_release_sequence_goes_on_through_a_relaxed_exchange) {
  const auto by = [](order head) {
    return program{{store(x, 1, relaxed), store(y, 1, head)},
                   {exchange(y, 2, relaxed)},
                   {load(y, acquire), load(x, relaxed)}};
  };
  EXPECT_FALSE(can_read(by(release), {1, 2, 0})); // the exchange read the release, the load read the exchange
  EXPECT_TRUE(can_read(by(release), {0, 2, 0}));  // the exchange came first
  EXPECT_TRUE(can_read(by(relaxed), {1, 2, 0}));
}

TEST(litmus, a_release_sequence_ends_at_a_plain_store_of_another_thread) {
  const program p{{store(x, 1, relaxed), store(y, 1, release)},
                  {load(y, relaxed), store(y, 2, relaxed)},
                  {load(y, acquire), load(x, relaxed)}};
  EXPECT_TRUE(can_read(p, {1, 2, 0}));
}

TEST(litmus, a_release_sequence_ends_at_a_plain_store_of_the_same_thread) { // since C++20
  const program p{{store(x, 1, relaxed), store(y, 1, release), store(y, 2, relaxed)},
                  {load(y, acquire), load(x, relaxed)}};
  EXPECT_FALSE(can_read(p, {1, 0}));
  EXPECT_TRUE(can_read(p, {2, 0}));
}

TEST(litmus, acquiring_one_exchange_of_a_chain_acquires_all_of_it) {
  const program p{{store(x, 1, relaxed), exchange(y, 1, release)},
                  {exchange(y, 2, release)},
                  {exchange(y, 3, acquire), load(x, relaxed)}};
  EXPECT_FALSE(can_read(p, {0, 1, 2, 0}));
  EXPECT_FALSE(can_read(p, {2, 0, 1, 0}));
  EXPECT_TRUE(can_read(p, {3, 0, 2, 0})); // the first thread came last
}

TEST(litmus, no_two_exchanges_read_the_same_store) {
  const program p{{exchange(x, 1, relaxed)}, {exchange(x, 2, relaxed)}, {store(x, 3, relaxed)}};
  for (const values& reads : {values{0, 0}, values{3, 3}}) EXPECT_FALSE(can_read(p, reads));
  for (const values& reads : {values{0, 1}, values{2, 0}, values{0, 3}, values{3, 0}}) {
    EXPECT_TRUE(can_read(p, reads));
  }
}

TEST(litmus, causality_passes_through_a_third_thread_by_release_and_acquire) { // WRC
  const auto by = [](order stores, order loads) {
    return program{
        {store(x, 1, stores)}, {load(x, loads), store(y, 1, stores)}, {load(y, loads), load(x, relaxed)}};
  };
  EXPECT_TRUE(can_read(by(relaxed, relaxed), {1, 1, 0}));
  EXPECT_FALSE(can_read(by(release, acquire), {1, 1, 0}));
}

TEST(litmus, seq_cst_is_no_stronger_than_the_standard_where_orders_mix_on_a_word) {
  // With C++11's wording, in which the total order agrees with happens-before, this could not be; since C++20
  // it can (and on POWER it happens). An explorer with a global clock for seq_cst would miss it.
  const program p{{store(x, 1, seq_cst), store(y, 1, release)},
                  {exchange(y, 2, seq_cst), load(y, relaxed)},
                  {store(y, 3, seq_cst), load(x, seq_cst)}};
  EXPECT_TRUE(can_read(p, {1, 3, 0}));
}

TEST(litmus, load_buffering_is_outside_the_model) {
  // C++ and ARM allow {1, 1} here. explorer.hpp says why rowe's structures do not depend on it.
  const program p{{load(x, relaxed), store(y, 1, relaxed)}, {load(y, relaxed), store(x, 1, relaxed)}};
  EXPECT_FALSE(can_read(p, {1, 1}));
  EXPECT_TRUE(can_read(p, {0, 1}));
}

} // namespace
} // namespace litmus_test
} // namespace rowe::model
