// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/outbox.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "service/state/state_fixture.hpp"

namespace outbox_test {
namespace {

using rowe::service::connection;
using rowe::service::counter;
using rowe::service::peer_index;
using rowe::service::queue;
using rowe::service::slot_id;

// An outbox, and peers that are connected.
struct outbox_test : state_fixture::state_fixture {
  explicit outbox_test(std::uint32_t slots = 8)
      : state_fixture{::state_fixture::with({.connections_max = 4,
                                             .message_bytes_max = 1024,
                                             .topics_max = 8,
                                             .subscriptions_max = 16,
                                             .small_slots = slots,
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
  void write_replies(peer_index peer, int count) {
    for (queue& from = out.of(peer).replies; count != 0 && !from.empty(); --count) {
      const auto slot = out.entries().front(from).index;
      out.take_front(from, slot);
      store.delivered(slot);
    }
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

TEST_F(outbox_test, takes_from_who_does_not_read_before_who_waits_for_others) {
  const auto waits = join(0), slow = join(1), waits_too = join(2), reader = join(3);
  out.of(waits).waits_to_begin = out.of(waits_too).waits_to_begin = true;
  out.of(slow).blocked = true;
  for (int i = 0; i < 2; ++i) {
    for (const peer_index each : {waits, slow, waits_too, reader}) ASSERT_TRUE(reply(each, "kept"));
  }
  ASSERT_TRUE(reply(reader, "one more"));
  EXPECT_EQ(out.of(slow).replies.count, 1U);
  EXPECT_EQ(out.of(waits).replies.count, 2U);
  EXPECT_EQ(out.of(waits_too).replies.count, 2U);
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

struct outbox_with_many_slots : outbox_test {
  outbox_with_many_slots() : outbox_test{100} {}
};

TEST_F(outbox_with_many_slots, has_fewer_places_for_replies_to_a_peer_that_does_not_read) {
  const auto reader = join(0), other = join(1);
  out.of(other).blocked = true;
  std::uint32_t to_reader = 0, to_other = 0;
  for (int i = 0; i < 80; ++i) {
    to_reader += reply(reader, "x");
    to_other += reply(other, "x");
    write_replies(reader, 1);
  }
  EXPECT_EQ(to_reader, 80U);
  EXPECT_EQ(to_other, rowe::service::replies_max_backpressured);
  EXPECT_EQ(counts.read(counter::outbox_full), 80U - to_other);
}

} // namespace
} // namespace outbox_test
