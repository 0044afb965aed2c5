// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/outbox.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "service/state/state_fixture.hpp"

namespace outbox_test {
namespace {

using rowe::service::connection;
using rowe::service::peer_index;
using rowe::service::slot_id;

// An outbox, and peers that are connected.
struct outbox_test : state_fixture::state_fixture {
  outbox_test()
      : state_fixture{::state_fixture::with({.connections_max = 4,
                                             .message_bytes_max = 1024,
                                             .topics_max = 8,
                                             .subscriptions_max = 16,
                                             .small_slots = 8,
                                             .small_slot_bytes = 256,
                                             .large_slots = 1,
                                             .queue_depth_max = 8,
                                             .queued_max = 64,
                                             .calls_max = 4})} {}

  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};

  peer_index join(std::uint32_t index) {
    connection& c = peers[{index}];
    c.id = {index, 1};
    c.state = connection::phase::open;
    peers.add();
    out.open({index});
    return {index};
  }
  bool reply(peer_index to, std::string_view text) {
    return out.reply(to, [&](rowe::json::writer& into) { into.append(text); }).value != slot_id::none;
  }
  void TearDown() override {
    EXPECT_TRUE(store.check());
    EXPECT_TRUE(out.check());
  }
};

TEST_F(outbox_test, takes_nothing_from_who_comes_to_the_place_of_one_that_held_most) {
  auto place = join(0);
  const auto hoarder = join(1), other = join(2);
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(reply(place, "of one that leaves"));
  ASSERT_TRUE(reply(hoarder, "a"));
  EXPECT_EQ(out.of(place).replies.count, 7U);
  out.forget(place);
  place = join(0);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(reply(place, "kept"));
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(reply(hoarder, "b"));
  ASSERT_TRUE(reply(other, "c"));
  EXPECT_EQ(out.of(place).replies.count, 3U);
  EXPECT_EQ(out.of(hoarder).replies.count, 4U);
}

TEST_F(outbox_test, says_whose_reply_was_evicted_to_whoever_tracks_it) {
  const auto peer = join(0);
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(reply(peer, "reply"));
  const auto oldest = out.entries().front(out.of(peer).replies).index;
  store.track(oldest, false);
  ASSERT_TRUE(reply(peer, "one more"));
  rowe::service::outcome told;
  ASSERT_TRUE(store.take_outcome(told));
  EXPECT_EQ(told.slot, oldest);
  EXPECT_TRUE(told.ended && told.evicted);
}

} // namespace
} // namespace outbox_test
