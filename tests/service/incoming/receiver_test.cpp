// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/receiver.hpp"

#include <gtest/gtest.h>

#include "service/state/state_fixture.hpp"

namespace receiver_test {
namespace {

using namespace std::chrono_literals;
using rowe::service::admission;
using rowe::service::connection;

struct receiver_test : state_fixture::state_fixture {
  receiver_test()
      : state_fixture{::state_fixture::with(
            {.connections_max = 4,
             .door_slots = 16, // a claim to one for each peer, and the other twelve for whoever comes
             .door_slot_bytes = 256,
             .handles_max = 3})} {}

  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};
  rowe::service::local_delivery delivery{state};
  rowe::service::receiver inbox{memory, {.state_ = state, .outbox_ = out, .local_delivery_ = delivery}};

  void join(std::uint32_t index) {
    connection& c = peers[{index}];
    c.id = {index, 1};
    c.state = connection::phase::open;
    peers.add();
    out.open({index});
  }
  rowe::status deliver(std::uint32_t from) {
    rowe::detail::value_header header;
    header.peer = {from, 1};
    header.expires_ns = rowe::rt::nanoseconds_of(rowe::rt::never);
    return inbox.deliver(header, "{}");
  }
  // Delivers what the peer may have.
  void deliver_all(std::uint32_t from) {
    while (inbox.admit({from}) == admission::now && deliver(from)) {
    }
  }
  // As a thread does: takes a message and releases its slot.
  void take() {
    const auto slot = threads_inbox.try_receive(cycle.now);
    ASSERT_TRUE(slot);
    (void)threads_inbox.release(*slot); // nobody waits
  }
  void TearDown() override { EXPECT_TRUE(inbox.check()); }
};

// The answer may be among those.
TEST_F(receiver_test, charges_a_peer_until_all_that_was_submitted_before_the_release_is_taken) {
  (void)threads_inbox.try_receive(cycle.now);
  join(0);
  deliver_all(0);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(submissions.submit(
        {.what = rowe::detail::entry::message, .peer = {0, 1}, .stamped = cycle.now}, "{}"));
    take();
  }
  inbox.mark_released();
  inbox.count_released(2);
  EXPECT_EQ(inbox.admit({0}), admission::later);
  inbox.count_released(1);
  EXPECT_EQ(inbox.admit({0}), admission::now);
}

TEST_F(receiver_test, charges_a_peer_for_answers_that_are_parked_on_the_way_to_it) {
  (void)threads_inbox.try_receive(cycle.now);
  join(0);
  ASSERT_EQ(inbox.admit({0}), admission::now);
  for (int i = 0; i < 16; ++i) inbox.count_answer({0});
  EXPECT_EQ(inbox.admit({0}), admission::later);
  inbox.begin_answers();
  EXPECT_EQ(inbox.admit({0}), admission::now);
}

} // namespace
} // namespace receiver_test
