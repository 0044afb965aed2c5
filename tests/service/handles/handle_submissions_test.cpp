// SPDX-License-Identifier: Apache-2.0
#include "service/handles/handle_submissions.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/core/all_parts.hpp"

namespace handle_submissions_test {
namespace {

using namespace all_parts;
using rowe::service::entries_per_cycle;

struct handle_submissions_test : all_parts::all_parts {
  handle_submissions_test()
      : all_parts{::state_fixture::with({.connections_max = 3, .door_slots = 8, .handles_max = 3})} {}

  rowe::service::handle_submissions& submitted = parts.handle_submissions_;

  pair_index attach(std::uint32_t depth = 8) {
    const pair_index at = offer_lane(false, depth);
    parts.handle_registry_.scan();
    return at;
  }
  void take(pair_index at) {
    submitted.begin_cycle();
    submitted.take(at);
  }
  // Until one message to the peer is parked.
  void fill(pair_index at, const connection& to) {
    for (int i = 0; i < 1000 && !state.pair_rows[at].parked_first; ++i) {
      ASSERT_TRUE(submit(at, "{\"n\":0}", ref(to)));
      take(at);
    }
    ASSERT_TRUE(state.pair_rows[at].parked_first);
  }
};

TEST_F(handle_submissions_test, are_taken_up_to_a_budget_and_the_rest_in_the_next_cycle) {
  constexpr std::uint32_t depth = entries_per_cycle + 10;
  const pair_index at = attach(depth);
  for (std::uint32_t i = 0; i < depth; ++i) ASSERT_TRUE(submit(at, "{}", {}, true));
  take(at);
  EXPECT_EQ(counts.read(counter::expired), entries_per_cycle) << "they were for nobody, and for now only";
  EXPECT_TRUE(submitted.more_left());
  EXPECT_FALSE(submitted.drained());
  EXPECT_TRUE(submitted.has_new(at));
  take(at);
  EXPECT_EQ(counts.read(counter::expired), depth);
  EXPECT_FALSE(submitted.more_left());
  EXPECT_TRUE(submitted.drained());
}

TEST_F(handle_submissions_test, keep_their_slots_while_they_are_parked_and_their_order_after_it) {
  connection& slow = connect();
  const pair_index at = attach();
  block(slow);
  fill(at, slow);
  for (const std::string_view text : {"{\"n\":1}", "{\"n\":2}"}) ASSERT_TRUE(submit(at, text, ref(slow)));
  take(at);
  EXPECT_FALSE(submitted.drained());
  EXPECT_TRUE(submitted.has_unsent(at));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(submit(at, "{}", {}, true)) << "eight slots, three are parked";
  EXPECT_FALSE(submit(at, "{}", {}, true));
  take(at);
  const auto freed = cycle.places_freed;
  unblock(slow);
  std::string all = hear(slow);
  take(at);
  EXPECT_FALSE(state.pair_rows[at].parked_first);
  EXPECT_EQ(cycle.places_freed, freed + 3);
  EXPECT_TRUE(submitted.drained());
  EXPECT_FALSE(submitted.has_unsent(at));
  all += hear(slow);
  EXPECT_LT(all.rfind("{\"n\":0}"), all.find("{\"n\":1}"));
  EXPECT_LT(all.find("{\"n\":1}"), all.find("{\"n\":2}"));
  EXPECT_NE(all.find("{\"n\":2}"), all.npos);
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(submit(at, "{}", {}, true)) << "all slots came back";
}

TEST_F(handle_submissions_test, leave_a_gap_where_one_in_the_middle_is_taken) {
  connection& slow = connect();
  connection& other = connect();
  const pair_index at = attach();
  block(slow);
  block(other);
  fill(at, slow);
  const pair_index by_another = attach();
  fill(by_another, other);
  for (const auto* to : {&other, &slow}) ASSERT_TRUE(submit(at, "{\"n\":1}", ref(*to)));
  take(at); // three are parked: for the one, the other, and the one
  unblock(other);
  (void)hear(other);
  take(at);
  take(by_another);
  (void)hear(other);
  EXPECT_TRUE(state.pair_rows[at].parked_first);
  unblock(slow);
  (void)hear(slow);
  take(at);
  EXPECT_FALSE(state.pair_rows[at].parked_first);
  EXPECT_FALSE(state.pair_rows[at].parked_last);
  EXPECT_TRUE(submitted.drained());
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(submit(at, "{}", {}, true)) << "all slots came back";
}

} // namespace
} // namespace handle_submissions_test
