// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/outbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "service/outgoing/subscription_queues.hpp"
#include "service/state/state_fixture.hpp"

namespace outbox_test {
namespace {

using namespace std::chrono_literals;
using rowe::priority;
using rowe::service::connection;
using rowe::service::counter;
using rowe::service::peer_index;
using rowe::service::queue;
using rowe::service::slot_id;
using rowe::service::subscription_id;
using rowe::service::topic_id;

rowe::limits few(std::uint32_t slots = 8) {
  return {.connections_max = 4,
          .message_bytes_max = 1024,
          .topics_max = 8,
          .subscriptions_max = 16,
          .small_slots = slots,
          .small_slot_bytes = 256,
          .large_slots = 1,
          .queue_depth_max = 8,
          .queued_max = 64,
          .calls_max = 4};
}

// An outbox with the tables it works on, and peers that are connected.
struct outbox_test : state_fixture::state_fixture {
  explicit outbox_test(const rowe::limits& of = few()) : state_fixture{::state_fixture::with(of)} {}

  const std::size_t used_before = memory.bytes_used();
  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};
  rowe::service::long_outbox long_out{{.state_ = state, .message_store_ = store, .outbox_ = out}};
  rowe::service::subscription_queues queues{
      {.state_ = state, .message_store_ = store, .outbox_ = out, .long_outbox_ = long_out}};

  peer_index join(std::uint32_t index) {
    connection& c = peers[{index}];
    c.id = {index, 1};
    c.state = connection::phase::open;
    peers.add();
    out.open({index});
    return {index};
  }
  topic_id topic(std::string_view name) {
    const auto index = topics.find_or_add(name);
    topics.hold(index);
    return index;
  }
  subscription_id subscribe(peer_index peer, topic_id topic, std::int64_t throttle_ms = 0,
                            std::uint32_t queue_length = 0) {
    const auto index = subscriptions.add(topic, peer);
    auto& s = subscriptions.at(index);
    s.request_count = 1;
    s.requests[0] = {.throttle = std::chrono::milliseconds{throttle_ms}, .queue_length = queue_length};
    queues.merge_requests(index);
    return index;
  }
  void publish(topic_id topic, std::string_view body, rowe::rt::time_point expires = rowe::rt::never) {
    const auto slot =
        out.compose_message(topic, cycle.now, expires, [&](rowe::json::writer& into) { into.append(body); });
    ASSERT_TRUE(slot);
    queues.fan_out(topic, slot, false);
    store.release(slot);
  }
  bool reply(peer_index to, std::string_view text) {
    return out.reply(to, [&](rowe::json::writer& into) { into.append(text); }).value != slot_id::none;
  }
  // The bodies that wait in a queue, oldest first.
  std::vector<std::string> waiting(const queue& of) {
    std::vector<std::string> all;
    for (auto at = of.entries.head; at; at = out.entries().after(at)) {
      const auto slot = out.entries().at(at);
      if (!store.is_due(slot)) continue;
      const auto body = store.slots().body(slot.index);
      all.emplace_back(body.begin(), body.end());
    }
    return all;
  }
  std::vector<std::string> waiting(subscription_id subscription) {
    return waiting(subscriptions.at(subscription).pending);
  }
  // As the sender does: everything of one subscription that is ready is written.
  void write(subscription_id subscription) {
    queue& from = subscriptions.at(subscription).pending;
    while (!from.empty()) {
      const auto slot = out.entries().front(from).index;
      out.take_front(from, slot);
      queues.mark_served(subscription);
      store.delivered(slot);
    }
  }
  void write_replies(peer_index peer, int count) {
    for (queue& from = out.of(peer).replies; count != 0 && !from.empty(); --count) {
      const auto slot = out.entries().front(from).index;
      out.take_front(from, slot);
      store.delivered(slot);
    }
  }
  std::vector<subscription_id> ready(peer_index peer, priority at = priority::normal) {
    std::vector<subscription_id> all;
    const auto& on = out.of(peer).ready[static_cast<std::size_t>(at)];
    for (auto i = on.head; i; i = subscriptions.all()[i].next_ready) all.push_back(i);
    return all;
  }
  void TearDown() override {
    EXPECT_TRUE(store.check());
    EXPECT_TRUE(out.check());
    EXPECT_TRUE(queues.check());
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

struct outbox_with_many_slots : outbox_test {
  outbox_with_many_slots() : outbox_test{few(100)} {}
};

} // namespace
} // namespace outbox_test
