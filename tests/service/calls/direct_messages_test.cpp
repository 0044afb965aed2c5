// SPDX-License-Identifier: Apache-2.0
#include "service/calls/direct_messages.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "service/calls/call_parts.hpp"
#include "json/padded.hpp"

namespace direct_messages_test {
namespace {

using namespace call_parts;
using rowe::errc;
using rowe::service::direct_message;
using rowe::service::pair_index;
using rowe::service::slot_id;
using numbers = std::vector<std::uint32_t>;

struct direct_messages_test : call_parts::call_parts {
  const pair_index handle = attach();

  pair_index attach() {
    const pair_index at = offer({.kind = rowe::detail::pair_kind::talk,
                                 .out_depth = 16,
                                 .in_depth = 4,
                                 .completions_depth = 256,
                                 .out_bytes = 64,
                                 .in_bytes = 64,
                                 .completions_bytes = 64});
    state.pairs[at].lifecycle.accept(state.pairs[at].arrival);
    state.pair_rows[at] = {.attached = true, .generation = 1};
    messages.parking().begin_turn(1000, false);
    return at;
  }
  // One that takes plain messages.
  connection& arrive() {
    connection& c = connect();
    c.takes_messages = true;
    return c;
  }
  // Its socket takes nothing more.
  void block(const connection& c) { transport.link_of(c.id).capacity_bytes = 0; }
  void write() {
    sending.flush_all();
    messages.take_outcomes();
    EXPECT_TRUE(messages.check());
  }
  static rowe::detail::peer_ref to(const connection& c) { return {c.id.index, c.id.generation}; }
  // The handle knows it by its number. False: it is to be parked.
  bool post(std::uint32_t number, direct_message m = {}) {
    const rowe::tests::padded text{"{\"n\":" + std::to_string(number) + "}"};
    if (m.text.empty()) m.text = text.text();
    m.sender = call_endpoint::of(handle, 1);
    m.own = {number, 1};
    return messages.post(m);
  }
  bool post(std::uint32_t number, const connection& c) { return post(number, {.text = {}, .to = to(c)}); }
  // Which have ended since the last look, and how.
  std::vector<std::pair<std::uint32_t, errc>> ended() {
    std::vector<std::pair<std::uint32_t, errc>> all;
    auto& from = state.pairs[handle].user.completions;
    while (const auto slot = from.ring->try_pop()) {
      const auto& header = *from.memory.header(*slot);
      all.emplace_back(header.own.index, header.failed ? header.outcome : sent);
      from.free_ring->release(*slot);
    }
    return all;
  }
  static constexpr errc sent{255}; // no error
  using ends = std::vector<std::pair<std::uint32_t, errc>>;
  // The numbers of the messages that have arrived at a peer, in their order.
  numbers heard(const connection& by) {
    numbers all;
    const std::string bytes = arrived(by);
    for (auto at = bytes.find("\"n\":"); at != bytes.npos; at = bytes.find("\"n\":", at + 1))
      all.push_back(static_cast<std::uint32_t>(std::stoul(bytes.substr(at + 4))));
    return all;
  }
  void expire() {
    while (const auto one = due.take_due(cycle.now)) {
      if (one->what == rowe::service::timer::slot) store.expire({one->index});
      messages.take_outcomes();
    }
  }
  // As many to this peer as it has room for.
  std::uint32_t fill(const connection& c) {
    std::uint32_t count = 0;
    while (post(1000 + count, c)) ++count;
    return count;
  }
};

TEST_F(direct_messages_test, end_when_they_found_no_peer_in_their_time) {
  EXPECT_TRUE(post(1, {.text = {}, .expires = cycle.now + 5ms}));
  EXPECT_TRUE(post(2));
  EXPECT_TRUE(post(3, {.text = {}, .expires = cycle.now + 50ms}));
  store.arm_unwritten();
  cycle.now += 20ms;
  expire();
  EXPECT_EQ(ended(), (ends{{1, errc::expired}}));
  EXPECT_EQ(messages.pending(), 2U);
  cycle.now += 60ms; // a peer comes before the wheel is looked at
  connection& late = arrive();
  messages.deliver_pending({late.id.index});
  write();
  EXPECT_EQ(heard(late), numbers{2});
  EXPECT_EQ(ended(), (ends{{3, errc::expired}, {2, sent}}));
}

TEST_F(direct_messages_test, tell_senders_of_room_when_nothing_is_parked_any_more) {
  connection& slow = arrive();
  block(slow);
  (void)fill(slow);
  messages.parking().begin_turn(16, false);
  while (!post(1, slow)) {
  }
  messages.parking().begin_cycle();
  messages.parking().begin_turn(16, false);
  (void)post(1, {.text = {}, .to = to(slow), .parked = true});
  EXPECT_FALSE(messages.parking().renew_room());
  messages.parking().begin_cycle();
  messages.parking().begin_turn(16, false);
  EXPECT_TRUE(messages.parking().renew_room());
  EXPECT_FALSE(out.of({slow.id.index}).marked_full);
  EXPECT_FALSE(messages.parking().renew_room()) << "once";
}

TEST_F(direct_messages_test, that_are_pending_requests_go_to_the_first_peer_that_comes) {
  const auto index = completion.open({}, {}, "/add", rowe::rt::never);
  const slot_id slot = out.compose(rowe::service::message_lifetime{},
                                   [](rowe::json::writer& into) { into.append("{\"n\":7}"); });
  EXPECT_TRUE(messages.send_request(slot, {}, calls.ref(index), false));
  EXPECT_EQ(messages.pending(), 1U);
  connection& first = arrive();
  connection& second = arrive();
  messages.place_pending();
  EXPECT_EQ(messages.pending(), 0U);
  EXPECT_TRUE(calls.at(index).callee.is(first.id));
  write();
  EXPECT_EQ(heard(first), numbers{7});
  EXPECT_EQ(heard(second), numbers{});
  completion.complete(index, "{}");
}

} // namespace
} // namespace direct_messages_test
