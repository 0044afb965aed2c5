// SPDX-License-Identifier: Apache-2.0
#include "service/handles/handle_registry.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/core/all_parts.hpp"
#include "json/padded.hpp"

namespace handle_registry_test {
namespace {

using namespace all_parts;
using rowe::errc;
using rowe::detail::pair_kind;
using rowe::detail::pair_phase;
using ::state_fixture::taken;

struct handle_registry_test : all_parts::all_parts {
  handle_registry_test()
      : all_parts{::state_fixture::with(
            {.connections_max = 3, .services_max = 4, .door_slots = 8, .lanes_max = 6})} {}

  rowe::service::handle_registry& handles = parts.handle_registry_;

  pair_index provide(std::string_view service) {
    return offer({.kind = pair_kind::respond_text,
                  .name = service,
                  .out_depth = 4,
                  .in_depth = 4,
                  .out_bytes = 192,
                  .in_bytes = 64});
  }
  void close(pair_index at) {
    pair(at).lifecycle.close();
    handles.scan();
  }
  pair_phase phase(pair_index at) { return pair(at).lifecycle.look(); }
  // A message of a peer, for whoever receives.
  rowe::status deliver(std::string_view text) {
    rowe::detail::value_header header;
    header.expires_ns = rowe::rt::nanoseconds_of(rowe::rt::never);
    return parts.receiver_.deliver(header, text);
  }
};

TEST_F(handle_registry_test, answers_each_handle_that_is_offered_once) {
  const pair_index at = offer_lane();
  EXPECT_EQ(phase(at), pair_phase::offered);
  handles.scan();
  EXPECT_EQ(phase(at), pair_phase::active);
  const auto generation = state.pair_rows[at].generation;
  handles.scan();
  EXPECT_EQ(state.pair_rows[at].generation, generation);
  EXPECT_EQ(handles.talking(), 1U);
}

TEST_F(handle_registry_test, tells_two_handles_on_one_queue_pair_apart) {
  const pair_index at = offer_lane();
  handles.scan();
  const auto before = state.pair_rows[at].generation;
  close(at);
  EXPECT_EQ(phase(at), pair_phase::free);
  EXPECT_EQ(state.pair_rows[at].generation, before) << "until it is used again";
  ASSERT_EQ(offer_lane(), at);
  handles.scan();
  EXPECT_EQ(state.pair_rows[at].generation, before + 1);
}

TEST_F(handle_registry_test, lets_one_handle_provide_a_service) {
  const pair_index first = provide("/add");
  const pair_index second = provide("add");
  handles.scan();
  EXPECT_EQ(phase(first), pair_phase::active);
  EXPECT_EQ(phase(second), pair_phase::refused);
  EXPECT_EQ(pair(second).lifecycle.refusal().code, errc::service_taken);
  EXPECT_EQ(handles.talking(), 1U);
  close(second);
  EXPECT_TRUE(parts.service_directory_.find("/add")) << "the one that was refused takes nothing with it";
  close(first);
  EXPECT_FALSE(parts.service_directory_.find("/add"));
  EXPECT_EQ(handles.talking(), 0U);
}

TEST_F(handle_registry_test, refuses_a_service_for_which_there_is_no_place) {
  for (int i = 0; i < 4; ++i) (void)provide("/s" + std::to_string(i));
  const pair_index more = provide("/more");
  handles.scan();
  EXPECT_EQ(phase(more), pair_phase::refused);
  EXPECT_EQ(pair(more).lifecycle.refusal().code, errc::too_many_services);
  EXPECT_EQ(pair(more).lifecycle.refusal().limit, 4);
}

TEST_F(handle_registry_test, gives_the_first_receiver_what_came_before_it) {
  ASSERT_TRUE(deliver("{\"n\":1}"));
  ASSERT_TRUE(deliver("{\"n\":2}"));
  const pair_index sends = offer_lane(false);
  const pair_index first = offer_lane();
  const pair_index second = offer_lane();
  handles.scan();
  EXPECT_EQ(parts.receiver_.pair(), first);
  EXPECT_EQ(taken(pair(first).user.in), "{\"n\":1}");
  EXPECT_EQ(taken(pair(first).user.in), "{\"n\":2}");
  EXPECT_EQ(taken(pair(second).user.in), "");
  EXPECT_EQ(taken(pair(sends).user.in), "");
  EXPECT_TRUE(threads_inbox.all_free());
  close(first);
  ASSERT_TRUE(deliver("{\"n\":3}"));
  EXPECT_EQ(taken(pair(second).user.in), "{\"n\":3}") << "the next one receives";
}

TEST_F(handle_registry_test, leaves_what_came_to_a_thread_that_receives) {
  ASSERT_TRUE(deliver("{\"n\":1}"));
  ASSERT_TRUE(deliver("{\"n\":2}"));
  const auto slot = threads_inbox.try_receive(cycle.now);
  ASSERT_TRUE(slot);
  const pair_index late = offer_lane();
  handles.scan();
  EXPECT_EQ(taken(pair(late).user.in), "");
  (void)threads_inbox.release(*slot); // nobody waits
}

TEST_F(handle_registry_test, sends_what_a_handle_submitted_before_it_closed) {
  connection& peer = connect();
  const pair_index at = offer_lane();
  handles.scan();
  ASSERT_TRUE(submit(at, "{\"n\":1}", ref(peer)));
  close(at);
  EXPECT_EQ(phase(at), pair_phase::free);
  EXPECT_NE(hear(peer).find("{\"n\":1}"), std::string::npos);
}

TEST_F(handle_registry_test, keeps_a_closed_handle_while_something_of_it_is_parked) {
  connection& peer = connect();
  const pair_index at = offer_lane(false);
  handles.scan();
  block(peer);
  for (int i = 0; i < 1000 && !state.pair_rows[at].parked_first; ++i) {
    ASSERT_TRUE(submit(at, "{}", ref(peer)));
    handles.scan();
    (void)hear(peer);
  }
  ASSERT_TRUE(state.pair_rows[at].parked_first);
  close(at);
  EXPECT_EQ(phase(at), pair_phase::closing);
  EXPECT_TRUE(parts.handle_submissions_.waits());
  unblock(peer);
  (void)hear(peer);
  handles.scan();
  EXPECT_EQ(phase(at), pair_phase::free);
}

TEST_F(handle_registry_test, gives_a_queue_pair_back_when_its_last_slot_is_released) {
  const pair_index at = offer_lane();
  handles.scan();
  ASSERT_TRUE(deliver("{}"));
  const auto slot = pair(at).user.in.ring->try_pop(); // somebody still looks at it
  ASSERT_TRUE(slot);
  close(at);
  EXPECT_EQ(phase(at), pair_phase::held);
  handles.scan();
  EXPECT_EQ(phase(at), pair_phase::held);
  pair(at).user.in.free_ring->release(*slot);
  handles.scan();
  EXPECT_EQ(phase(at), pair_phase::free);
}

TEST_F(handle_registry_test, keeps_what_a_handles_thread_counted) {
  const pair_index at = offer_lane();
  handles.scan();
  pair(at).refused_full.add();
  pair(at).refused_full.add();
  pair(at).expired_here.add();
  close(at);
  EXPECT_EQ(counts.read(counter::full), 2U);
  EXPECT_EQ(counts.read(counter::inbound_expired), 1U);
  handles.scan();
  EXPECT_EQ(counts.read(counter::full), 2U) << "once";
}

} // namespace
} // namespace handle_registry_test
