// SPDX-License-Identifier: Apache-2.0
#include "service/handles/handle_registry.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/core/all_parts.hpp"

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
            {.connections_max = 3, .services_max = 4, .door_slots = 8, .handles_max = 6})} {}

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
