// SPDX-License-Identifier: Apache-2.0
// Times to live through the core: what a peer is told of them, what is taken of what peers say, and what is
// left of them behind a hub.
#include <rowe/lane.hpp>
#include <rowe/subscriber.hpp>

#include "core_fixtures.hpp"

namespace core_time_to_live_test {
namespace {

using namespace harness;
using rowe::errc;
using rowe::detail::entry;

struct times_to_live : core_test {
  times_to_live() : core_test{with_limits(hub_options(), &limits::door_slot_bytes, 16 * 1024)} {}
  peer rowe_peer() { return peer{on, rowe::service::side::server, "127.0.0.1:1", "/", "rowe.v1"}; }
  peer subscriber() {
    peer made = rowe_peer();
    made.tell(R"({"op":"subscribe","topic":"/pose"})");
    return made;
  }
  rowe::subscriber<rowe::json_text> text_handle() {
    auto& pair = on.offer_now(rowe::detail::pair_kind::subscribe_text, "/pose", 256);
    return rowe::subscriber<rowe::json_text>{core_harness::handle_of(pair)};
  }
  std::uint32_t send(std::string_view text, rowe::duration ttl) {
    const auto slot = on.submissions.submit({.what = entry::message,
                                             .wants_outcome = true,
                                             .stamped = on.now,
                                             .expires = rowe::rt::deadline_after(on.now, ttl)},
                                            text);
    EXPECT_TRUE(slot);
    return *slot;
  }
  std::string outcome(std::uint32_t slot) { return outcome_of(on, slot); }
};

std::string with_ttl(std::string_view ms, int x) {
  return R"({"op":"publish","ttl_ms":)" + std::string{ms} + R"(,"topic":"/pose","msg":{"x":)" +
         std::to_string(x) + R"(,"y":0}})";
}

TEST_F(times_to_live, are_told_to_rowe_endpoints_only) {
  auto& pair = advertise_pose(on, {.ttl = 50ms});
  peer endpoint = subscriber();
  peer browser = harness::subscriber(on, "/pose");
  peer old_name{on, rowe::service::side::server, "127.0.0.1:1", "/", "rowe.v1"};
  old_name.tell(R"({"op":"subscribe","topic":"pose"})");
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_EQ(endpoint.hear(), texts{with_ttl("49", 1)});
  EXPECT_EQ(browser.hear(), texts{message(1)}) << "who speaks rosbridge alone sees what it saw before";
  EXPECT_EQ(old_name.hear(), texts{R"({"op":"publish","ttl_ms":49,"topic":"pose","msg":{"x":1,"y":0}})"});
}

TEST_F(times_to_live, are_not_told_where_there_is_none) {
  auto& pair = advertise_pose(on);
  peer endpoint = subscriber();
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  EXPECT_EQ(endpoint.hear_after(1), texts{message(1)});
}

TEST_F(times_to_live, count_the_time_in_the_queue) {
  auto& pair = advertise_pose(on, {.ttl = 50ms});
  peer slow = subscriber();
  on.net.link_of(slow.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  on.cycles(29);
  on.cycle(250us);
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  on.cycle(0ms);
  on.cycle(0ms);
  EXPECT_EQ(slow.hear(), (texts{with_ttl("19.750", 1), with_ttl("20.750", 2)}));
}

// The last microsecond is not worth a frame: it would have to say 0.
TEST_F(times_to_live, end_before_nothing_is_left_to_tell) {
  auto& pair = advertise_pose(on, {.ttl = 50ms});
  peer slow = subscriber();
  on.net.link_of(slow.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  on.cycle();
  on.cycle(49ms - 1us);
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  on.cycle(0ms);
  on.cycle(0ms);
  EXPECT_EQ(slow.hear(), (texts{with_ttl("0.001", 1), with_ttl("0.001", 2)}));
  on.net.link_of(slow.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish_now(on, pair, {3, 0}));
  on.cycle(49ms - 999ns);
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  on.cycles(2, 0ms);
  EXPECT_TRUE(slow.hear().empty());
  EXPECT_EQ(on.count(counter::expired), 1U);
}

// Another peer gets the same slot later, while a part of this frame waits for the socket.
TEST_F(times_to_live, stay_as_they_were_in_a_frame_that_was_begun) {
  auto& pair = advertise_pose(on, {.ttl = 50ms});
  for (int bytes = 1; bytes < 80; ++bytes) {
    peer slow = subscriber(); // nobody has pinged it yet
    peer slower = subscriber();
    on.net.link_of(slow.id()).capacity_bytes = static_cast<std::size_t>(bytes);
    on.net.link_of(slower.id()).capacity_bytes = 0;
    ASSERT_TRUE(publish(on, pair, {1, 0}));
    on.cycles(10);
    on.net.link_of(slower.id()).capacity_bytes = 4096;
    on.cycle(); // its room is noticed
    EXPECT_EQ(slower.hear(), texts{with_ttl("39", 1)}) << bytes;
    on.net.link_of(slow.id()).capacity_bytes = 4096;
    EXPECT_EQ(slow.hear_after(2), texts{with_ttl("49", 1)}) << bytes;
    slow.leave();
    slower.leave();
    on.cycle();
  }
}

TEST_F(times_to_live, of_peers_hold_for_the_handles_of_this_process) {
  auto handle = text_handle();
  peer endpoint = rowe_peer();
  endpoint.say(R"({"op":"publish","topic":"/pose","msg":{"x":1},"ttl_ms":5})");
  endpoint.say(R"({"op":"publish","topic":"/pose","msg":{"x":2},"ttl_ms":5.5})");
  endpoint.say(R"({"op":"publish","topic":"/pose","msg":{"x":3}})");
  on.cycle();
  const auto first = handle.try_take(on.now + 5ms - 1ns);
  ASSERT_TRUE(first);
  EXPECT_EQ(**first, R"({"x":1})");
  const auto last = handle.try_take(on.now + 5500us);
  ASSERT_TRUE(last);
  EXPECT_EQ(**last, R"({"x":3})") << "one without a time to live is always taken";
  EXPECT_EQ(handle.expired(), 1U);
  EXPECT_EQ(handle.try_take(on.now).code(), errc::empty);
}

TEST_F(times_to_live, of_this_process_hold_for_its_own_handles) {
  auto& pair = advertise_pose(on, {.ttl = 5ms});
  auto& inbox = on.offer_now(rowe::detail::pair_kind::subscribe_value, "/pose", sizeof(pose),
                             {.keep = rowe::keep::newest}, &rowe::describe<pose>(), "test/Pose");
  rowe::subscriber<pose> handle{core_harness::handle_of(inbox)};
  const auto published = on.now;
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_TRUE(handle.latest(published + 5ms - 1ns));
  ASSERT_TRUE(publish_now(on, pair, {2, 0}));
  EXPECT_EQ(handle.latest(published + 7ms).code(), errc::empty);
  EXPECT_EQ(handle.expired(), 1U);
}

TEST_F(times_to_live, are_carried_on_by_a_hub) {
  peer viewer = subscriber();
  peer browser = harness::subscriber(on, "/pose");
  peer robot = rowe_peer();
  on.cycle();
  on.net.link_of(viewer.id()).capacity_bytes = 0;
  robot.tell(R"({"op":"publish","topic":"/pose","ttl_ms":30,"msg":{"x":1,"y":0}})", 11);
  on.net.link_of(viewer.id()).capacity_bytes = 4096;
  on.cycle();
  EXPECT_EQ(viewer.hear(), texts{with_ttl("19", 1)});
  EXPECT_EQ(browser.hear(), texts{message(1)});
}

// The receiver has no room for what the peer said first. That is parked, and the rest of what was read waits.
TEST_F(times_to_live, count_the_time_behind_a_parked_message) {
  auto handle = text_handle();
  peer viewer = subscriber();
  peer robot = rowe_peer();
  EXPECT_FALSE(on.inbox.try_receive(on.now)); // somebody receives
  on.cycle();
  for (std::uint32_t i = 0; i <= on.options.limits.door_slots; ++i) robot.say("{}");
  robot.say(R"({"op":"publish","topic":"/pose","ttl_ms":30,"msg":{"x":1,"y":0}})");
  robot.say(R"({"op":"publish","topic":"/pose","ttl_ms":10,"msg":{"x":2,"y":0}})");
  on.cycles(3, 0ms);
  const auto read_at = on.now;
  EXPECT_TRUE(viewer.hear_after(10).empty()) << "it is not parked";
  while (const auto slot = on.inbox.try_receive(on.now)) {
    on.inbox.release(*slot);
    on.cycle(0ms);
  }
  on.cycles(3, 0ms);
  EXPECT_EQ(viewer.hear(), texts{with_ttl("20", 1)});
  EXPECT_EQ(on.count(counter::expired), 1U);
  EXPECT_EQ(handle.try_take(read_at + 30ms).code(), errc::empty);
  EXPECT_EQ(handle.expired(), 1U);
}

TEST_F(times_to_live, that_are_over_are_carried_nowhere) {
  peer viewer = subscriber();
  peer browser = harness::subscriber(on, "/pose");
  peer robot = rowe_peer();
  on.cycle();
  robot.say(R"({"op":"publish","topic":"/pose","ttl_ms":0,"msg":{"x":1,"y":0}})");
  robot.say(R"({"op":"publish","topic":"/pose","ttl_ms":0.0005,"msg":{"x":2,"y":0}})");
  on.cycle();
  EXPECT_TRUE(viewer.hear().empty());
  EXPECT_TRUE(browser.hear().empty());
  EXPECT_EQ(on.count(counter::expired), 3U); // one nowhere, the other at both
}

TEST_F(times_to_live, hold_for_latched_values) {
  peer robot = rowe_peer();
  robot.say(R"({"op":"advertise","topic":"/pose","latch":true,"type":"test/Pose"})");
  peer holder = subscriber();
  robot.tell(R"({"op":"publish","topic":"/pose","ttl_ms":30,"msg":{"x":1,"y":0}})", 11);
  peer late = subscriber();
  on.cycle(0ms);
  EXPECT_EQ(late.hear(), texts{with_ttl("19", 1)});
  on.cycles(30);
  peer too_late = subscriber();
  EXPECT_TRUE(too_late.hear_after(1).empty());
}

TEST_F(times_to_live, that_make_no_sense_are_refused) {
  peer robot{on};
  on.cycle();
  for (const char* ttl : {"-1", "\"5\"", "null"})
    robot.say(R"({"op":"publish","topic":"/pose","msg":{},"ttl_ms":)" + std::string{ttl} + "}");
  const texts said = robot.hear_after(1);
  ASSERT_EQ(said.size(), 3U);
  EXPECT_TRUE(has(said[0], R"(\"ttl_ms\" must not be negative; it is -1)"));
  EXPECT_TRUE(has(said[1], R"(\"ttl_ms\" must be a number of milliseconds; it is \"5\")"));
  EXPECT_TRUE(has(said[2], R"(it is null)"));
}

TEST_F(times_to_live, are_told_in_plain_messages_of_any_form) {
  peer there = peer_saying(on, "{}");
  for (const char* text : {R"({"a":1})", "{}", "  { }", "\n{ \"a\" : {} }"}) {
    const auto slot = send(text, 10ms);
    on.cycle();
    EXPECT_EQ(outcome(slot), "sent");
  }
  EXPECT_EQ(there.hear(), (texts{R"({"ttl_ms":9,"a":1})", R"({"ttl_ms":9})", R"({"ttl_ms":9 })",
                                 R"({"ttl_ms":9, "a" : {} })"}));
}

TEST_F(times_to_live, are_taken_out_of_what_a_rowe_endpoint_put_them_into) {
  peer there{on};
  (void)on.inbox.try_receive(on.now);
  on.cycle();
  const std::pair<const char*, const char*> texts[] = {{R"({"ttl_ms":9.5,"a":1})", R"({"a":1})"},
                                                       {R"({"ttl_ms":9})", "{}"},
                                                       {R"({"ttl_ms":9, "a" : 1})", R"({ "a" : 1})"},
                                                       {R"({"a":1,"ttl_ms":9})", R"({"a":1,"ttl_ms":9})"}};
  for (const auto& [said, taken] : texts) {
    there.tell(said);
    const auto slot = on.inbox.try_receive(on.now);
    ASSERT_TRUE(slot);
    EXPECT_EQ(on.inbox.text(*slot), taken);
    on.inbox.release(*slot);
  }
}

TEST_F(times_to_live, are_not_told_twice) {
  peer there = peer_saying(on, "{}");
  const auto refused = send(R"({"a":1,"ttl_ms":5})", 10ms);
  const auto own = send(R"({"a":2,"ttl_ms":5})", -1ns);
  on.cycle();
  EXPECT_EQ(outcome(refused), "reserved_member");
  EXPECT_EQ(outcome(own), "sent") << "without a time to live the member is the sender's own";
  EXPECT_EQ(there.hear(), texts{R"({"a":2,"ttl_ms":5})"});
}

TEST_F(times_to_live, leave_a_message_that_is_sent_now_or_never_as_it_is) {
  peer there{on};
  there.say("{}");
  peer viewer = subscriber();
  auto& pair = advertise_pose_now(on, {.ttl = 0ms});
  const auto slot = send(R"({"a":1})", 0ns);
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(there.hear(), texts{R"({"a":1})"});
  EXPECT_EQ(viewer.hear(), (texts{R"({"a":1})", message(1)}));
}

// The text and its member must fit into what a message may have.
TEST_F(times_to_live, take_room_in_the_message) {
  peer there = peer_saying(on, "{}");
  const std::size_t most = on.options.limits.message_bytes_max;
  const auto text_of = [](std::size_t bytes) { return R"({"a":")" + std::string(bytes - 8, 'x') + R"("})"; };
  const auto too_big = send(text_of(most), 10ms);
  const auto fits = send(text_of(most - 27), 10ms);
  const auto fits_alone = send(text_of(most), -1ns);
  on.cycles(3);
  EXPECT_EQ(outcome(too_big), "too_big");
  EXPECT_EQ(outcome(fits), "sent");
  EXPECT_EQ(outcome(fits_alone), "sent");
  const texts heard = there.hear();
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_EQ(heard[0].size(), most - 27 + std::string_view{R"("ttl_ms":9,)"}.size());
}

struct hop_peers : core_test {
  hop_peers()
      : core_test{[] {
          auto chosen = small_options();
          chosen.profile = rowe::websocket_profile::hop;
          return chosen;
        }()} {}
};

TEST_F(hop_peers, are_told_no_time_to_live) {
  peer hop{on};
  on.cycle();
  const auto slot = on.submissions.submit(
      {.what = entry::message, .stamped = on.now, .expires = on.now + 9ms}, R"({"a":1})");
  ASSERT_TRUE(slot);
  EXPECT_EQ(hop.hear_after(1), texts{R"({"a":1})"});
}

// A client masks what it says, so each frame is copied.
struct client_with_times : core_test {
  client_with_times() : core_test{small_options()}, client{small_options(), rowe::service::side::client} {}
  core_harness client;
};

TEST_F(client_with_times, tells_them_to_a_rowe_server_and_to_no_other) {
  for (const char* subprotocol : {"rowe.v1", ""}) {
    auto& pair = client.offer(rowe::detail::pair_kind::publish_value, "/pose", sizeof(pose), {.ttl = 50ms},
                              &rowe::describe<pose>(), "test/Pose");
    peer server{client, rowe::service::side::client, "127.0.0.1:9", "/", subprotocol};
    server.hear_after(2);
    ASSERT_TRUE(publish(client, pair, {1, 0}));
    EXPECT_EQ(server.hear_after(1), texts{*subprotocol == 0 ? message(1) : with_ttl("49", 1)});
    server.leave();
    pair.lifecycle.close();
    client.cycles(2);
  }
  EXPECT_TRUE(client.core.check());
}

} // namespace
} // namespace core_time_to_live_test
