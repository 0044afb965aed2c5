// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/message_store.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "service/state/state_fixture.hpp"

namespace message_store_test {
namespace {

using namespace std::chrono_literals;
using rowe::service::counter;
using rowe::service::message_store;
using rowe::service::outcome;
using rowe::service::slot_class;
using rowe::service::slot_id;
using rowe::service::slot_use;
using rowe::service::timer;

struct message_store_test : state_fixture::state_fixture {
  message_store_test()
      : state_fixture{::state_fixture::with({.connections_max = 4,
                                             .message_bytes_max = 4096,
                                             .subscriptions_max = 4,
                                             .small_slots = 3,
                                             .small_slot_bytes = 256,
                                             .large_slots = 2,
                                             .calls_max = 4})} {}

  message_store store{memory, state};
  int asked_for_room = 0;

  slot_id compose(std::string_view text, rowe::rt::time_point expires = rowe::rt::never) {
    return store.compose(
        rowe::service::message_lifetime{expires}, [&](rowe::json::writer& into) { into.append(text); },
        slot_use::ordinary, [&](slot_class) { ++asked_for_room; });
  }
  std::vector<outcome> outcomes() {
    std::vector<outcome> all;
    for (outcome one; store.take_outcome(one);) all.push_back(one);
    return all;
  }
  // The only one that there is.
  outcome only_outcome() {
    const auto all = outcomes();
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? outcome{} : all[0];
  }
  void pass(rowe::rt::duration time) {
    cycle.now += time;
    while (const auto one = due.take_due(cycle.now)) {
      ASSERT_EQ(one->what, timer::slot);
      store.expire({one->index});
    }
  }
  void TearDown() override { EXPECT_TRUE(store.check()); }
};

TEST_F(message_store_test, writes_what_does_not_fit_a_small_slot_into_a_large_one) {
  const auto slot = compose(std::string(1000, 'x'));
  ASSERT_TRUE(slot);
  EXPECT_EQ(store.slots().class_of(slot), slot_class::large);
  EXPECT_EQ(store.slots().in_use(), 1U);
}

TEST_F(message_store_test, asks_for_room_where_all_slots_are_taken_and_counts_what_finds_none) {
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(compose("x")); // three small ones, then two large ones
  EXPECT_FALSE(compose("x"));
  EXPECT_GT(asked_for_room, 0);
  EXPECT_EQ(counts.read(counter::no_slot), 1U);
}

TEST_F(message_store_test, keeps_a_slot_for_the_stop) {
  for (int i = 0; i < 5; ++i) (void)compose("x");
  const auto write = [](rowe::json::writer& into) { into.append("stop"); };
  const auto none = [](slot_class) { FAIL() << "nobody makes room for the stop"; };
  EXPECT_TRUE(store.compose(rowe::service::message_lifetime{}, write, slot_use::stop, none));
}

TEST_F(message_store_test, counts_what_no_slot_is_large_enough_for) {
  EXPECT_FALSE(compose(std::string(10'000, 'x')));
  EXPECT_EQ(counts.read(counter::too_big), 1U);
  EXPECT_EQ(store.slots().in_use(), 0U);
}

TEST_F(message_store_test, frees_what_is_over_whoever_still_has_it) {
  const auto slot = compose("x", cycle.now + 5ms);
  const auto ref = store.slots().ref(slot);
  store.slots().retain(slot);
  store.arm_unwritten();
  EXPECT_TRUE(store.is_due(ref));
  pass(4ms);
  EXPECT_TRUE(store.is_due(ref));
  pass(2ms);
  EXPECT_FALSE(store.is_due(ref));
  EXPECT_EQ(store.slots().in_use(), 0U);
  EXPECT_EQ(counts.read(counter::expired), 2U); // as many as had it
}

TEST_F(message_store_test, says_once_that_something_expires_with_this_cycle) {
  (void)compose("x", cycle.now);
  EXPECT_TRUE(store.take_expires_this_cycle());
  EXPECT_FALSE(store.take_expires_this_cycle());
}

TEST_F(message_store_test, notes_no_outcome_of_what_nobody_tracks) {
  const auto slot = compose("x");
  store.delivered(slot);
  EXPECT_FALSE(store.has_outcomes());
}

TEST_F(message_store_test, notes_that_a_message_was_sent_and_ended) {
  const auto slot = compose("x");
  store.track(slot, false);
  store.delivered(slot);
  const outcome told = only_outcome();
  EXPECT_EQ(told.slot, slot);
  EXPECT_TRUE(told.sent && told.ended && !told.evicted && !told.expired);
  EXPECT_EQ(store.slots().in_use(), 0U);
}

TEST_F(message_store_test, notes_that_a_message_was_sent_before_its_other_deliveries_end) {
  const auto slot = compose("x");
  store.track(slot, false);
  store.slots().retain(slot); // for a second peer
  store.delivered(slot);
  auto told = only_outcome();
  EXPECT_TRUE(told.sent && !told.ended);
  store.release(slot);
  told = only_outcome();
  EXPECT_TRUE(told.ended);
}

TEST_F(message_store_test, keeps_a_message_that_lost_its_deliveries_until_it_is_let_go) {
  const auto slot = compose("x");
  store.track(slot, true);
  store.slots().retain(slot); // queued for one peer,
  store.release(slot);        // which leaves
  auto told = only_outcome();
  EXPECT_TRUE(told.ended && !told.sent);
  EXPECT_EQ(store.slots().in_use(), 1U);
  store.drop_pinned(slot);
  EXPECT_EQ(store.slots().in_use(), 0U);
  EXPECT_FALSE(store.has_outcomes());
}

TEST_F(message_store_test, keeps_a_message_no_longer_than_until_it_was_sent_once) {
  const auto slot = compose("x");
  store.track(slot, true);
  store.slots().retain(slot);
  store.delivered(slot);
  EXPECT_EQ(store.slots().in_use(), 0U);
  const outcome told = only_outcome();
  EXPECT_TRUE(told.sent && told.ended);
}

TEST_F(message_store_test, notes_that_a_message_was_evicted) {
  const auto slot = compose("x");
  store.track(slot, false);
  store.note_evicted(slot);
  store.release(slot);
  const outcome told = only_outcome();
  EXPECT_TRUE(told.ended && told.evicted);
}

TEST_F(message_store_test, notes_that_the_time_of_a_message_was_over) {
  const auto slot = compose("x", cycle.now + 1ms);
  store.track(slot, false);
  store.arm_unwritten();
  pass(10ms);
  const outcome told = only_outcome();
  EXPECT_TRUE(told.expired && !told.ended);
}

TEST_F(message_store_test, tells_outcomes_in_the_order_in_which_they_came_about) {
  const auto first = compose("a"), second = compose("b"), third = compose("c");
  for (const slot_id slot : {first, second, third}) store.track(slot, false);
  store.delivered(second);
  store.release(third);
  store.delivered(first);
  std::vector<slot_id> order;
  for (const outcome& one : outcomes()) order.push_back(one.slot);
  EXPECT_EQ(order, (std::vector{second, third, first}));
}

TEST_F(message_store_test, cancels_what_is_queued) {
  const auto slot = compose("x");
  store.track(slot, false);
  const auto ref = store.slots().ref(slot);
  EXPECT_TRUE(store.cancel(ref));
  EXPECT_FALSE(store.slots().alive(ref));
  EXPECT_FALSE(store.has_outcomes());
  EXPECT_FALSE(store.cancel(ref)); // it is gone
}

TEST_F(message_store_test, does_not_cancel_what_a_socket_has_the_beginning_of) {
  const auto slot = compose("x", cycle.now + 1ms);
  store.track(slot, false);
  store.arm_unwritten();
  store.slots().begin(slot);
  EXPECT_FALSE(store.cancel(store.slots().ref(slot)));
  pass(20ms); // nor does it expire
  EXPECT_EQ(store.slots().in_use(), 1U);
  store.slots().end(slot);
  store.delivered(slot);
  EXPECT_EQ(outcomes().size(), 1U);
}

} // namespace
} // namespace message_store_test
