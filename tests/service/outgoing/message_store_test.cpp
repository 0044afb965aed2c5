// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/message_store.hpp"

#include <gtest/gtest.h>

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

TEST_F(message_store_test, asks_for_room_where_all_slots_are_taken_and_counts_what_finds_none) {
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(compose("x")); // three small ones, then two large ones
  EXPECT_FALSE(compose("x"));
  EXPECT_GT(asked_for_room, 0);
  EXPECT_EQ(counts.read(counter::no_slot), 1U);
}

TEST_F(message_store_test, notes_that_the_time_of_a_message_was_over) {
  const auto slot = compose("x", cycle.now + 1ms);
  store.track(slot, false);
  store.arm_unwritten();
  pass(10ms);
  const outcome told = only_outcome();
  EXPECT_TRUE(told.expired && !told.ended);
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
