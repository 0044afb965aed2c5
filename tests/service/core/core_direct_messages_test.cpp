// SPDX-License-Identifier: Apache-2.0
// Plain messages through the core: how they find their peers, what their senders learn,
// and who in this process receives.
#include <rowe/lane.hpp>

#include "core_fixtures.hpp"

namespace core_direct_messages_test {
namespace {

using namespace harness;
using rowe::errc;
using rowe::detail::entry;

// A queue to one peer that does not read is full before that has its share of the slots.
rowe::endpoint_options with_many_slots() { return with_limits(small_options(), &limits::small_slots, 128); }

struct plain_messages : core_test {
  plain_messages() : core_test{with_many_slots()} {}

  // A message of a thread that waits for what becomes of it, or not.
  std::uint32_t send(std::string_view text, rowe::duration ttl = -1ns, bool waits = true,
                     rowe::detail::peer_ref to = {}) {
    const auto slot =
        on.submissions.submit({.what = entry::message,
                               .wants_outcome = waits,
                               .peer = to,
                               .stamped = on.now,
                               .expires = ttl == 0ns ? on.now : rowe::rt::deadline_after(on.now, ttl)},
                              text);
    EXPECT_TRUE(slot);
    return *slot;
  }
  // What became of it; "waits" while nothing has.
  std::string outcome(std::uint32_t slot) {
    const bool ended = on.submissions.incomplete() == 0 || on.submissions.drained();
    return ended ? outcome_of(on, slot) : "waits";
  }
  std::string received() {
    const auto slot = on.inbox.try_receive(on.now);
    if (!slot) return std::string{slot.error().name()};
    std::string text{on.inbox.text(*slot)};
    on.inbox.release(*slot);
    return text;
  }
};

TEST_F(plain_messages, gives_a_message_to_every_peer_that_has_spoken_plain) {
  peer plain{on}, other{on}, silent{on};
  on.cycle();
  plain.say(R"({"hello":1})");
  other.say(R"({"hello":2})");
  on.cycle();
  const auto slot = send(R"({"a":1})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(plain.hear(), texts{R"({"a":1})"});
  EXPECT_EQ(other.hear(), texts{R"({"a":1})"});
  EXPECT_EQ(silent.hear(), texts{}) << "it has not used the plain format, so it gets none unasked";
}

TEST_F(plain_messages, says_that_a_message_is_sent_when_one_peer_has_it) {
  peer reads{on}, stalled{on};
  reads.say("{}");
  stalled.say("{}");
  on.cycle();
  on.net.link_of(stalled.id()).capacity_bytes = 0;
  const auto slot = send(R"({"a":1})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "sent");
  stalled.leave();
  on.cycle();
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(plain_messages, lets_a_message_wait_for_a_peer) {
  const auto slot = send(R"({"a":1})", 5s);
  on.cycles(1000, 1ms);
  EXPECT_EQ(outcome(slot), "waits");
  peer late = peer_saying(on, "{}", 2);
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(late.hear(), texts{R"({"ttl_ms":3999,"a":1})"});
}

TEST_F(plain_messages, drops_a_message_that_found_no_peer_in_its_time) {
  const auto slot = send(R"({"a":1})", 5s);
  on.cycles(5002, 1ms);
  EXPECT_EQ(outcome(slot), "expired");
  EXPECT_EQ(on.count(counter::expired), 1U);
  peer late{on};
  EXPECT_EQ(late.ask("{}", 2), texts{});
}

TEST_F(plain_messages, does_not_let_a_message_wait_whose_time_to_live_is_nothing) {
  const auto slot = send(R"({"a":1})", 0ns);
  on.cycle();
  EXPECT_EQ(outcome(slot), "expired");
  peer there = peer_saying(on, "{}");
  const auto now = send(R"({"a":2})", 0ns);
  on.cycle();
  EXPECT_EQ(outcome(now), "sent");
  EXPECT_EQ(there.hear(), texts{R"({"a":2})"});
}

TEST_F(plain_messages, does_not_send_behind_a_blocked_socket_what_must_go_now) {
  peer there = peer_saying(on, "{}");
  on.net.link_of(there.id()).capacity_bytes = 0;
  const auto slot = send(R"({"a":1})", 0ns);
  on.cycles(3);
  EXPECT_EQ(outcome(slot), "expired");
  on.net.link_of(there.id()).capacity_bytes = 4096;
  EXPECT_EQ(there.hear_after(3), texts{});
}

TEST_F(plain_messages, checks_the_time_when_it_writes) {
  peer there = peer_saying(on, "{}");
  on.net.link_of(there.id()).capacity_bytes = 0;
  const auto expired = send(R"({"a":1})", 50ms);
  const auto alive = send(R"({"a":2})", 500ms);
  on.cycles(100);
  on.net.link_of(there.id()).capacity_bytes = 4096;
  there.hear(); // reads, so that there is room
  EXPECT_EQ(there.hear_after(3), texts{R"({"ttl_ms":399,"a":2})"});
  EXPECT_EQ(outcome(expired), "expired");
  EXPECT_EQ(outcome(alive), "sent");
}

TEST_F(plain_messages, keeps_the_order_of_one_sender) {
  peer there = peer_saying(on, "{}");
  for (int i = 0; i < 4; ++i) send(R"({"a":)" + std::to_string(i) + "}", -1ns, false);
  EXPECT_EQ(there.hear_after(2), (texts{R"({"a":0})", R"({"a":1})", R"({"a":2})", R"({"a":3})"}));
}

TEST_F(plain_messages, sends_to_the_next_peer_what_the_last_one_was_not_given) {
  peer first = peer_saying(on, "{}");
  on.net.link_of(first.id()).capacity_bytes = 5; // the message begins, and does not end
  const auto slot = send(R"({"a":1})", 5s);
  on.cycle();
  first.leave(rowe::service::close_cause::reset);
  on.cycles(2);
  EXPECT_EQ(outcome(slot), "waits");
  peer second = peer_saying(on, "{}", 2);
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(second.hear(), texts{R"({"ttl_ms":4996,"a":1})"});
}

TEST_F(plain_messages, gives_more_waiting_messages_than_a_queue_holds_in_their_order) {
  constexpr int count = 40; // the queue of a peer holds 16
  texts all;
  for (int i = 0; i < count; ++i) {
    all.push_back(R"({"a":)" + std::to_string(i) + "}");
    send(all.back(), -1ns, false);
    on.cycle();
  }
  peer late{on};
  late.say("{}");
  texts heard;
  for (int i = 0; i < 6; ++i) {
    if (i == 1) send(all.emplace_back(R"({"a":"last"})"), -1ns, false);
    on.cycle();
    for (auto& text : late.hear()) heard.push_back(std::move(text));
  }
  EXPECT_EQ(heard, all);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(plain_messages, gives_what_one_peer_left_without_to_another_that_is_there) {
  peer first = peer_saying(on, "{}");
  on.net.link_of(first.id()).capacity_bytes = 0;
  const auto slot = send(R"({"a":1})");
  on.cycle();
  peer second = peer_saying(on, "{}");
  first.leave();
  on.cycles(2);
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(second.hear(), texts{R"({"a":1})"});
}

TEST_F(plain_messages, keeps_a_message_where_it_is_while_no_peer_has_room) {
  peer one{on}, other{on};
  for (auto* p : {&one, &other}) {
    p->tell("{}");
    on.net.link_of(p->id()).capacity_bytes = 0;
  }
  texts all;
  for (int i = 0; i < 18; ++i) {
    all.push_back(R"({"a":)" + std::to_string(i) + "}");
    send(all.back(), -1ns, false);
    on.cycle();
  }
  for (auto* p : {&one, &other}) on.net.link_of(p->id()).capacity_bytes = 4096;
  on.cycles(3);
  EXPECT_EQ(one.hear(), all);
  EXPECT_EQ(other.hear(), all);
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

TEST_F(plain_messages, tells_a_sender_that_the_one_it_meant_is_gone) {
  peer one = peer_saying(on, "{}");
  const rowe::detail::peer_ref to{one.id().index, one.id().generation};
  on.net.link_of(one.id()).capacity_bytes = 0;
  const auto queued = send(R"({"a":1})", 5s, true, to);
  on.cycle();
  one.leave();
  on.cycles(2);
  EXPECT_EQ(outcome(queued), "peer_lost");
  const auto late = send(R"({"a":2})", 5s, true, to);
  on.cycle();
  EXPECT_EQ(outcome(late), "peer_lost");
}

TEST_F(plain_messages, leaves_slots_to_topics_and_to_peers_however_many_messages_wait_for_a_peer) {
  for (int i = 0; i < 200; ++i) {
    // What finds the submission queue full is told so.
    (void)on.submissions.submit({.what = entry::message, .stamped = on.now}, R"({"a":1})");
    on.cycle();
  }
  const std::uint32_t slots = on.options.limits.small_slots;
  const std::uint32_t connections = on.options.limits.connections_max;
  const std::uint32_t tracked = slots - slots / 4 - connections;
  const std::uint32_t claimed = tracked / 2 / connections * connections;
  const std::uint32_t for_messages = tracked - claimed;
  EXPECT_EQ(on.core.slots_in_use(), for_messages);
  peer late = peer_saying(on, "{}", 40);
  EXPECT_EQ(late.hear().size(), for_messages + on.options.limits.door_slots / 2);
}

TEST_F(plain_messages, tells_whoever_waits_that_the_endpoint_is_closing) {
  const auto waiting = send(R"({"a":1})", 5s);
  on.cycle();
  on.core.close_all(on.now);
  EXPECT_EQ(outcome(waiting), "closed");
  EXPECT_EQ(on.count(counter::lost_at_close), 1U);
}

TEST_F(plain_messages, waits_in_its_lane_when_the_only_peer_does_not_read) {
  peer slow = peer_saying(on, "{}");
  on.net.link_of(slow.id()).capacity_bytes = 0;
  int accepted = 0;
  for (int i = 0; i < 100; ++i) {
    const auto slot = on.submissions.submit({.what = entry::message, .stamped = on.now}, R"({"a":1})");
    accepted += static_cast<bool>(slot);
    on.cycle();
  }
  EXPECT_EQ(accepted, static_cast<int>(on.options.limits.queue_depth_max + on.options.limits.door_slots / 2))
      << "the other half is for what is not for everyone";
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

// Fills the queue towards a peer that does not read, and leaves one more in the submission queue.
struct parked : plain_messages {
  parked() {
    slow.say("{}");
    fine.say("{}");
    on.cycle();
    on.net.link_of(slow.id()).capacity_bytes = 0;
    for (std::uint32_t i = 0; i <= on.options.limits.queue_depth_max; ++i) {
      send(R"({"to":"slow"})", -1ns, false, to_slow);
      on.cycle();
    }
    EXPECT_EQ(on.submissions.incomplete(), 1U);
  }
  peer slow{on}, fine{on};
  rowe::detail::peer_ref to_slow{slow.id().index, slow.id().generation};
  rowe::detail::peer_ref to_fine{fine.id().index, fine.id().generation};
};

TEST_F(parked, does_not_keep_other_threads_from_other_peers) {
  send(R"({"to":"fine"})", -1ns, false, to_fine);
  send(R"({"to":"all"})", -1ns, false);
  EXPECT_EQ(fine.hear_after(1), (texts{R"({"to":"fine"})", R"({"to":"all"})"}));
  EXPECT_EQ(on.submissions.incomplete(), 1U);
}

TEST_F(parked, does_not_keep_calls_and_replies_from_their_way) {
  while (received() != "empty") continue; // and from now on the shared inbox takes calls
  fine.tell(R"({"service":"x","message_id":1})");
  const auto asked = on.inbox.try_receive(on.now);
  ASSERT_TRUE(asked);
  ASSERT_TRUE(on.submissions.submit(
      {.what = entry::reply, .call = on.inbox.header(*asked).call, .stamped = on.now}, R"({"done":true})"));
  on.inbox.release(*asked);
  EXPECT_EQ(fine.hear_after(1), texts{R"({"done":true,"in_reply_to":1})"});
}

TEST_F(parked, tells_who_waits_behind_it_that_the_time_is_over) {
  const auto slot = send(R"({"to":"slow"})", 20ms, true, to_slow);
  on.cycles(30);
  ASSERT_EQ(on.submissions.incomplete(), 1U) << "the second is over, the first goes on waiting";
  EXPECT_TRUE(on.submissions.wait(slot, rowe::rt::never));
  EXPECT_EQ(on.submissions.outcome(slot).code(), errc::expired);
  on.submissions.release(slot);
}

TEST_F(parked, keeps_the_order_towards_it) {
  send(R"({"to":"slow","last":true})", -1ns, false, to_slow);
  on.cycle();
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  const auto heard = slow.hear_after(3);
  ASSERT_EQ(heard.size(), on.options.limits.queue_depth_max + 2);
  EXPECT_EQ(heard.back(), R"({"to":"slow","last":true})");
}

TEST_F(plain_messages, refuses_texts_that_are_no_message) {
  for (const auto& [text, why] :
       {std::pair{"{", "malformed"}, std::pair{"[1]", "not_an_object"}, std::pair{"7", "not_an_object"},
        std::pair{R"({"op":"publish"})", "reserved_member"},
        std::pair{R"({"message_id":1})", "reserved_member"},
        std::pair{R"({"in_\u0072eply_to":1})", "reserved_member"}}) {
    const auto slot = send(text);
    on.cycle();
    EXPECT_EQ(outcome(slot), why) << text;
  }
  EXPECT_EQ(on.count(counter::malformed), 6U);
}

TEST_F(plain_messages, gives_what_peers_say_to_whoever_receives) {
  peer there{on};
  there.say(R"({"speed":1})");
  there.say(R"({"speed":2,"ttl_ms":5})");
  there.say(R"({"speed":3,"ttl_ms":5000})");
  on.cycle();
  EXPECT_EQ(received(), R"({"speed":1})");
  on.cycles(10);
  EXPECT_EQ(received(), R"({"speed":3,"ttl_ms":5000})") << "the second is out of date";
  EXPECT_EQ(received(), "empty");
  on.cycle();
  EXPECT_EQ(on.count(counter::inbound_expired), 1U);
}

TEST_F(plain_messages, counts_messages_that_find_the_inbox_full) {
  peer there{on};
  for (int i = 0; i < 10; ++i) there.say(R"({"speed":1})");
  on.cycle();
  EXPECT_EQ(on.count(counter::inbox_full), 10U - on.options.limits.door_slots);
}

TEST_F(plain_messages, refuses_plain_texts_that_are_no_objects) {
  peer there{on};
  there.say("[1,2]");
  there.say(R"({"op":5})");
  const auto heard = there.hear_after(1);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(heard[0].find(R"("code":"not_an_object")") != std::string::npos) << heard[0];
  EXPECT_TRUE(heard[1].find(R"("code":"bad_request")") != std::string::npos) << heard[1];
}

// The same in a queue pair, behind a message for the peer that does not read.
struct parked_in_a_lane : parked {
  parked_in_a_lane() {
    talk = on.open<rowe::lane>(lane_request(4, 192));
    while (talk.try_receive(on.now)) continue;
    EXPECT_TRUE(talk.try_send(R"({"to":"slow"})", -1ns, on.now, {to_slow.index, to_slow.generation}));
    on.cycle();
  }
  rowe::lane talk;
};

TEST_F(parked_in_a_lane, goes_on_with_other_peers_calls_and_replies) {
  fine.tell(R"({"service":"x","message_id":1})");
  const auto asked = talk.try_receive(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(talk.try_send(R"({"to":"fine"})", -1ns, on.now, {to_fine.index, to_fine.generation}));
  EXPECT_TRUE(talk.try_reply(*asked, R"({"done":true})", on.now));
  EXPECT_EQ(fine.hear_after(1), (texts{R"({"done":true,"in_reply_to":1})", R"({"to":"fine"})"}));
}

TEST_F(parked_in_a_lane, counts_what_waits_when_the_endpoint_closes) {
  EXPECT_TRUE(talk.try_send(R"({"to":"all"})", -1ns, on.now));
  on.core.close_all(on.now);
  EXPECT_EQ(on.submissions.incomplete(), 0U);
  EXPECT_EQ(on.count(counter::lost_at_close), 2U) << "one in the lane, and one in the submission queue";
  const auto late = send(R"({"to":"all"})");
  on.cycle();
  EXPECT_EQ(outcome(late), "closed");
  EXPECT_EQ(on.count(counter::lost_at_close), 4U) << "nothing goes out any more";
}

TEST_F(parked_in_a_lane, has_slots_for_others_when_half_of_them_wait_for_one_peer) {
  const rowe::connection to{to_slow.index, to_slow.generation};
  const rowe::connection other{to_fine.index, to_fine.generation};
  EXPECT_TRUE(talk.try_send(R"({"n":1})", 5ms, on.now, to));
  on.cycle();
  EXPECT_EQ(talk.try_send("{}", -1ns, on.now, to).code(), errc::full);
  EXPECT_EQ(talk.wait_room(0ns, to).code(), errc::timed_out);
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(talk.wait_room(0ns, other));
    EXPECT_TRUE(talk.try_send(R"({"to":"fine"})", -1ns, on.now, other));
    on.cycle();
  }
  EXPECT_EQ(fine.hear().size(), 8U);
  EXPECT_TRUE(talk.try_send(R"({"to":"all"})", -1ns, on.now)) << "who does not read loses it";
  EXPECT_EQ(fine.hear_after(10).size(), 1U);
  EXPECT_EQ(on.count(counter::expired), 1U);
  EXPECT_EQ(talk.try_send("{}", -1ns, on.now, to).code(), errc::full) << "until nothing waits for it";
  on.net.link_of(slow.id()).capacity_bytes = 64 * 1024;
  on.cycles(4);
  EXPECT_TRUE(talk.wait_room(0ns, to));
  EXPECT_TRUE(talk.try_send(R"({"n":2})", -1ns, on.now, to));
  EXPECT_EQ(slow.hear_after(2).back(), R"({"n":2})");
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_EQ(on.count(counter::full), 2U);
}

TEST_F(parked_in_a_lane, ends_what_is_beyond_the_share_of_a_peer_that_does_not_read) {
  const rowe::connection to{to_slow.index, to_slow.generation};
  EXPECT_TRUE(talk.try_send(R"({"n":1})", -1ns, on.now, to));
  EXPECT_TRUE(talk.try_send(R"({"n":2})", -1ns, on.now, to));
  on.cycle();
  EXPECT_EQ(on.count(counter::outbox_full), 1U) << "the one after half of the slots";
  on.net.link_of(slow.id()).capacity_bytes = 64 * 1024;
  const auto heard = slow.hear_after(4);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), R"({"n":1})"), 1);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), R"({"n":2})"), 0);
}

TEST_F(parked_in_a_lane, forgets_the_share_of_a_peer_that_left) {
  EXPECT_TRUE(talk.try_send(R"({"n":1})", -1ns, on.now, {to_slow.index, to_slow.generation}));
  on.cycle();
  slow.leave(rowe::service::close_cause::reset);
  on.cycles(2);
  EXPECT_EQ(talk.try_send("{}", -1ns, on.now, {to_slow.index, to_slow.generation}).code(), errc::peer_lost);
  EXPECT_EQ(talk.wait_room(0ns, {to_slow.index, to_slow.generation}).code(), errc::peer_lost);
  peer next{on};
  on.cycle();
  ASSERT_EQ(next.id().index, to_slow.index);
  EXPECT_TRUE(talk.try_send(R"({"n":2})", -1ns, on.now, {next.id().index, next.id().generation}));
  EXPECT_EQ(next.hear_after(1), texts{R"({"n":2})"});
}

TEST_F(parked, tells_a_thread_that_waits_what_became_of_a_message_beyond_the_share) {
  send(R"({"to":"slow"})", -1ns, false, to_slow);
  const auto slot = send(R"({"to":"slow"})", -1ns, true, to_slow);
  on.cycle();
  EXPECT_TRUE(on.submissions.wait(slot, rowe::rt::never));
  EXPECT_EQ(on.submissions.outcome(slot).code(), errc::full);
  on.submissions.release(slot);
  EXPECT_EQ(on.count(counter::outbox_full), 1U);
}

// While threads receive they may have more parked than afterwards, when a queue pair does.
TEST(parked_messages, keeps_what_was_parked_when_another_one_begins_to_receive) {
  auto options = with_many_slots();
  options.limits.small_slots = 512;
  options.limits.door_slots = 8;
  core_harness on{options};
  const std::uint32_t queued = options.limits.queue_depth_max;
  peer slow[3] = {peer{on}, peer{on}, peer{on}};
  std::uint32_t sent[3] = {};
  const auto send = [&](std::size_t to) {
    const auto slot = on.submissions.submit({.what = entry::message,
                                             .wants_outcome = false,
                                             .peer = {slow[to].id().index, slow[to].id().generation},
                                             .stamped = on.now,
                                             .expires = rowe::rt::never},
                                            R"({"n":1})");
    ASSERT_TRUE(slot);
    ++sent[to];
    on.cycle();
  };
  on.cycle();
  for (std::size_t i = 0; i < 3; ++i) {
    on.net.link_of(slow[i].id()).capacity_bytes = 0;
    for (std::uint32_t n = 0; n < queued; ++n) send(i);
  }
  for (const std::size_t to : {0U, 0U, 0U, 0U, 1U, 1U, 2U}) send(to); // a half, a quarter, an eighth
  on.offer(lane_request(4, 192));
  on.cycles(3);
  for (std::size_t i = 0; i < 3; ++i) on.net.link_of(slow[i].id()).capacity_bytes = 64 * 1024;
  on.cycles(5);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(slow[i].hear().size(), sent[i]);
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

// What one sender has for everyone waits whole, and leaves the other half of its slots.
TEST_F(plain_messages, has_slots_for_calls_when_half_of_them_wait_for_everyone) {
  peer slow{on};
  slow.say("{}");
  auto talk = on.open<rowe::lane>(lane_request(4, 4096, false));
  on.net.link_of(slow.id()).capacity_bytes = 0;
  for (std::uint32_t i = 0; i < on.options.limits.queue_depth_max + 2; ++i) {
    EXPECT_TRUE(talk.try_send(R"({"to":"all"})", -1ns, on.now));
    on.cycle();
  }
  EXPECT_EQ(talk.try_send("{}", -1ns, on.now).code(), errc::full);
  EXPECT_EQ(talk.wait_room(0ns).code(), errc::timed_out);
  EXPECT_TRUE(talk.start(R"({"service":"/rosapi/topics"})", 1s, on.now));
  on.cycle();
  const auto end = talk.try_finish();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->reply);
  on.net.link_of(slow.id()).capacity_bytes = 64 * 1024;
  on.cycles(4);
  EXPECT_TRUE(talk.wait_room(0ns));
  EXPECT_EQ(slow.hear().size(), on.options.limits.queue_depth_max + 2);
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

// Each takes what it can as long as it reads, and then does not read any more.
TEST(parked_messages, has_a_slot_for_who_reads_beside_a_crowd_that_stopped_reading) {
  core_harness on{with_limits(with_many_slots(), &limits::small_slots, 64, &limits::connections_max, 16)};
  std::vector<peer> crowd;
  for (int i = 0; i < 12; ++i) crowd.emplace_back(on);
  peer reads{on};
  auto talk = on.open<rowe::lane>(lane_request(64, 192, false));
  for (peer& one : crowd) {
    on.net.link_of(one.id()).capacity_bytes = 0;
    for (int i = 0; i < 16; ++i)
      (void)talk.try_send("{}", -1ns, on.now, {one.id().index, one.id().generation});
    on.cycle();
  }
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(talk.try_send("{}", -1ns, on.now, {reads.id().index, reads.id().generation}));
    EXPECT_EQ(reads.hear_after(1).size(), 1U) << i;
  }
  EXPECT_EQ(on.core.inconsistency(), "");
}

TEST_F(plain_messages, leaves_large_slots_to_others_than_a_peer_that_does_not_read) {
  peer slow{on}, fine{on};
  slow.say("{}");
  fine.say("{}");
  auto talk = on.open<rowe::lane>(lane_request(16, 2048, false));
  on.net.link_of(slow.id()).capacity_bytes = 0;
  const std::string large = R"({"a":")" + std::string(1500, 'x') + R"("})";
  for (std::uint32_t i = 0; i < on.options.limits.large_slots; ++i)
    EXPECT_TRUE(talk.try_send(large, -1ns, on.now, {slow.id().index, slow.id().generation}));
  on.cycle();
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(talk.try_send(large, -1ns, on.now, {fine.id().index, fine.id().generation}));
    on.cycle();
  }
  EXPECT_EQ(fine.hear(), texts(5, large));
}

TEST_F(plain_messages, leaves_large_slots_to_others_however_many_calls_wait_for_a_peer) {
  auto talk = on.open<rowe::lane>(lane_request(16, 2048, false));
  const std::string large = R"({"service":"/a","x":")" + std::string(1500, 'x') + R"("})";
  for (std::uint32_t i = 0; i < 2 * on.options.limits.large_slots; ++i) {
    EXPECT_TRUE(talk.start(large, -1ns, on.now));
    on.cycle();
  }
  const auto end = talk.try_finish();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->reply.code(), errc::full);
  EXPECT_NE(on.count(counter::no_slot), 0U);
  peer asks{on};
  asks.say(R"({"op":"call_service","service":"/rowe/stats","id":"s"})"); // its answer takes a large slot
  texts heard = asks.hear_after(2);
  std::erase_if(heard,
                [](const std::string& text) { return !text.starts_with(R"({"op":"service_response")"); });
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_TRUE(has(heard[0], R"("result":true)"));
  EXPECT_EQ(on.core.inconsistency(), "");
}

TEST_F(plain_messages, keeps_the_order_towards_a_peer_when_slots_are_short) {
  peer slow{on}, slow_too{on}, fine{on};
  slow.say("{}");
  slow_too.say("{}");
  fine.say("{}");
  auto talk = on.open<rowe::lane>(lane_request(8, 2048, false));
  on.net.link_of(slow.id()).capacity_bytes = 0;
  on.net.link_of(slow_too.id()).capacity_bytes = 0;
  const auto send_to = [&](const peer& to, const std::string& text) {
    EXPECT_TRUE(talk.try_send(text, -1ns, on.now, {to.id().index, to.id().generation}));
  };
  const std::string large = R"({"a":")" + std::string(1500, 'x') + R"("})";
  // Two take what nobody may take alone.
  for (int i = 0; i < 2; ++i) send_to(slow, large);
  for (int i = 0; i < 2; ++i) send_to(slow_too, large);
  on.cycle();
  EXPECT_TRUE(talk.try_send(large, -1ns, on.now)); // to everyone; there is no slot for it
  send_to(fine, R"({"a":1})");
  EXPECT_TRUE(talk.try_send(R"({"a":2})", 0ns, on.now)); // now or never, and not before the others
  EXPECT_EQ(fine.hear_after(3), texts{});
  slow.leave();
  slow_too.leave();
  EXPECT_EQ(fine.hear_after(3), (texts{large, R"({"a":1})"}));
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

struct plain_messages_client : core_test {
  plain_messages_client() : core_test{small_options(), rowe::service::side::client} {}
};

TEST_F(plain_messages_client, sends_to_its_server_without_being_asked) {
  const auto slot =
      on.submissions.submit({.what = entry::message, .wants_outcome = true, .stamped = on.now}, R"({"a":1})");
  on.cycle();
  peer server{on, rowe::service::side::client};
  EXPECT_EQ(server.hear_after(2), texts{R"({"a":1})"});
  EXPECT_TRUE(on.submissions.wait(*slot, rowe::rt::never));
  EXPECT_TRUE(on.submissions.outcome(*slot));
  on.submissions.release(*slot);
}

TEST(plain_messages_hop, sends_nothing_but_text_frames_of_a_size_that_hop_can_read) {
  auto options = small_options();
  options.profile = rowe::websocket_profile::hop_2014;
  options.limits.message_bytes_max = 128 * 1024;
  options.limits.door_slot_bytes = 100 * 1024;
  core_harness on{options, rowe::service::side::client};
  const auto large = on.submissions.submit({.what = entry::message, .wants_outcome = true, .stamped = on.now},
                                           R"({"a":")" + std::string(65535, 'x') + R"("})");
  const auto small =
      on.submissions.submit({.what = entry::message, .wants_outcome = true, .stamped = on.now}, R"({"a":1})");
  const auto id = on.net.open(rowe::service::side::client);
  on.cycles(20, 1s); // long enough for pings
  const auto sent = on.net.sent(id);
  const std::string bytes{reinterpret_cast<const char*>(sent.data()), sent.size()};
  EXPECT_EQ(bytes, std::string("\x81\x07", 2) + R"({"a":1})") << "one frame, unmasked";
  EXPECT_TRUE(on.submissions.wait(*large, rowe::rt::never));
  EXPECT_EQ(on.submissions.outcome(*large).code(), errc::too_big);
  EXPECT_TRUE(on.submissions.wait(*small, rowe::rt::never));
  EXPECT_TRUE(on.submissions.outcome(*small));
  on.submissions.release(*large);
  on.submissions.release(*small);
  EXPECT_TRUE(on.core.check());
}

} // namespace
} // namespace core_direct_messages_test
