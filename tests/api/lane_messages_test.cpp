// SPDX-License-Identifier: Apache-2.0
// Lanes of whole endpoints: plain messages and calls in the style of a loop, and what ordinary threads say in
// the same words.
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "endpoints.hpp"
#include "rt/watchdog.hpp"

namespace lane_messages_test {
namespace {

using namespace endpoints;
using rowe::endpoint;
using rowe::errc;
using rowe::message;

rowe::time_point clock_now() { return rowe::rt::monotonic_clock::now(); }

// The call of this lane that ends next.
rowe::result<rowe::call_end> finished(rowe::lane& of) {
  std::optional<rowe::result<rowe::call_end>> ended;
  EXPECT_TRUE(eventually([&] { return ended.emplace(of.try_finish()).has_value(); }));
  return std::move(*ended);
}

// What ordinary threads and lanes have in common.
struct ordinary_threads {
  static endpoint& open(endpoint& on) { return on; }
  static std::string refusal(endpoint& by) {
    std::string why;
    EXPECT_EQ(by.invoke(message("service", "x"), timeout, rowe::everyone, &why).code(), errc::refused);
    return why;
  }
};
struct lanes {
  static rowe::lane open(endpoint& on) { return on.open_lane().value(); }
  static std::string refusal(rowe::lane& by) {
    EXPECT_EQ(by.invoke(message("service", "x"), timeout).code(), errc::refused);
    return std::string{by.refusal()};
  }
};
template <class>
struct messages : testing::Test {};
using handles = testing::Types<ordinary_threads, lanes>;
TYPED_TEST_SUITE(messages, handles);

TEST(lanes, have_several_calls_in_flight_without_waiting) {
  auto hop = endpoint::listen(0, quick()).value();
  auto answers = hop.open_lane().value();
  auto robot = connected(hop);
  auto lane = robot.open_lane({.calls = 4}).value();
  rowe::call_id started[4];
  for (int i = 0; i < 4; ++i) {
    const auto begun = lane.start(message("service", "x", "n", i), timeout, clock_now());
    ASSERT_TRUE(begun);
    started[i] = *begun;
  }
  EXPECT_EQ(lane.start("{}", timeout, clock_now()).code(), errc::too_many_calls);
  lane.cancel(started[1]);
  // Answered backwards, between unrelated messages.
  std::vector<rowe::message_view> calls;
  while (calls.size() < 4) {
    auto call = answers.receive(timeout);
    ASSERT_TRUE(call);
    calls.push_back(std::move(*call));
  }
  for (std::size_t i = 4; i-- > 0;) {
    ASSERT_TRUE(answers.try_send(message("unrelated", i), timeout, calls[i].from()));
    const std::string_view text = calls[i].value();
    ASSERT_TRUE(answers.try_reply(calls[i], message("n", text[text.find(R"("n":)") + 4] - '0'), clock_now()));
  }
  for (const int expected : {3, 2, 0}) {
    const auto ended = finished(lane);
    ASSERT_TRUE(ended->reply);
    EXPECT_EQ(ended->id, started[expected]);
    EXPECT_TRUE(says(ended->reply->value(), message("n", expected).text()));
  }
  EXPECT_EQ(lane.try_finish().code(), errc::empty);
  for (std::size_t i = 4; i-- > 0;) EXPECT_EQ(lane.receive(timeout)->value(), message("unrelated", i).text());
}

TEST(lanes, send_to_everyone_and_to_one) {
  auto options = quick();
  options.plain_unasked = true;
  auto robot = endpoint::listen(0, options).value();
  auto lane = robot.open_lane().value();
  auto first = connected(robot);
  auto second = connected(robot);
  ASSERT_TRUE(eventually([&] { return robot.peers() == 2; }));
  ASSERT_TRUE(lane.send(R"({"to":"all"})", timeout));
  EXPECT_EQ(first.receive(timeout)->value(), R"({"to":"all"})");
  EXPECT_EQ(second.receive(timeout)->value(), R"({"to":"all"})");
  ASSERT_TRUE(lane.try_send(R"({"to":"one"})", timeout, robot.connections()[0].id));
  ASSERT_TRUE(lane.try_send(R"({"to":"both"})", timeout));
  std::size_t alone = 0;
  for (endpoint* one : {&first, &second}) {
    auto heard = one->receive(timeout);
    ASSERT_TRUE(heard);
    if (heard->value() == R"({"to":"one"})") {
      ++alone;
      heard = one->receive(timeout);
    }
    EXPECT_EQ(heard->value(), R"({"to":"both"})");
  }
  EXPECT_EQ(alone, 1U);
}

TYPED_TEST(messages, wait_for_a_peer_as_long_as_the_time_to_live) {
  auto robot = endpoint::listen(0, quick()).value();
  auto&& speaks = TypeParam::open(robot);
  EXPECT_EQ(speaks.send("{}", 0ns).code(), errc::expired);
  const auto began = clock_now();
  EXPECT_EQ(speaks.send("{}", 20ms).code(), errc::expired);
  EXPECT_GE(clock_now() - began, 20ms);
  auto talker = endpoint::connect(url_of(robot), quick()).value();
  auto&& said = TypeParam::open(talker);
  EXPECT_TRUE(said.send(R"({"early":true})", -1ns)); // before the connection stands
  EXPECT_EQ(speaks.receive(timeout)->value(), R"({"early":true})");
}

TYPED_TEST(messages, tell_what_is_no_message_to_who_waits) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  auto&& speaks = TypeParam::open(viewer);
  const std::string deep = R"({"a":)" + std::string(100, '[') + std::string(100, ']') + "}";
  EXPECT_EQ(speaks.send(deep, timeout).code(), errc::too_deep);
  EXPECT_EQ(speaks.send("[1]", timeout).code(), errc::not_an_object);
  EXPECT_EQ(speaks.send("{", timeout).code(), errc::malformed);
  EXPECT_EQ(speaks.send(R"({"op":"publish"})", timeout).code(), errc::reserved_member);
  EXPECT_EQ(speaks.invoke("1", timeout).code(), errc::not_an_object);
  EXPECT_EQ(speaks.invoke("nothing", timeout).code(), errc::malformed);
  EXPECT_EQ(speaks.invoke(R"({"message_id":1})", timeout).code(), errc::reserved_member);
  EXPECT_EQ(speaks.invoke(R"({"in_reply_to":1})", timeout).code(), errc::reserved_member);
}

TEST(lanes, count_what_is_no_message_where_nobody_waits) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  auto lane = viewer.open_lane().value();
  ASSERT_TRUE(lane.try_send("{", timeout));
  EXPECT_TRUE(eventually([&] { return count_of(viewer, "malformed") > 0; }));
}

TYPED_TEST(messages, tell_lost_peers_time_outs_and_missing_services_apart) {
  std::optional<endpoint> hop{endpoint::listen(0, quick()).value()};
  auto robot = connected(*hop);
  EXPECT_EQ(hop->invoke(message("service", "x"), timeout).code(), errc::no_service);
  auto&& asks = TypeParam::open(robot);
  EXPECT_EQ(asks.invoke(message("service", "x"), timeout).code(), errc::no_service);
  auto silent = hop->open_lane().value();
  ASSERT_TRUE(goes_out(robot, [&] {
    EXPECT_EQ(asks.invoke(message("service", "x"), 20ms).error(),
              (rowe::error{errc::timed_out, 0, 20'000'000}));
  }));
  std::thread waits{
      [&] { EXPECT_EQ(asks.invoke(message("service", "x"), timeout).code(), errc::peer_lost); }};
  EXPECT_TRUE(silent.receive(timeout));
  EXPECT_TRUE(silent.receive(timeout)); // both calls came
  hop.reset();
  waits.join();
}

TYPED_TEST(messages, refuse_with_a_diagnostic) {
  auto hop = endpoint::listen(0, answering()).value();
  auto robot = connected(hop);
  const auto refusing =
      answering_thread(hop, [&](const rowe::received& call) { (void)hop.refuse(call, "not today"); });
  auto&& asks = TypeParam::open(robot);
  EXPECT_EQ(TypeParam::refusal(asks), "not today");
}

TEST(lanes, that_do_not_receive_leave_it_to_others) {
  auto robot = endpoint::listen(0, quick()).value();
  auto mute = robot.open_lane({.receive = false}).value();
  auto open = robot.open_lane().value();
  auto viewer = connected(robot);
  ASSERT_TRUE(viewer.send(R"({"n":1})", timeout));
  EXPECT_EQ(open.receive(timeout)->value(), R"({"n":1})");
  EXPECT_EQ(mute.try_receive().code(), errc::empty);
}

TEST(lanes, say_closed_when_the_endpoint_closes_while_they_wait) {
  auto robot = endpoint::listen(0, quick()).value();
  auto receives = robot.open_lane().value();
  auto sends = robot.open_lane({.receive = false}).value();
  auto invokes = robot.open_lane({.receive = false}).value();
  std::thread first{[&] { EXPECT_EQ(receives.receive(-1ns).code(), errc::closed); }};
  std::thread second{[&] { EXPECT_EQ(sends.send("{}", -1ns).code(), errc::closed); }};
  EXPECT_TRUE(eventually([&] { return count_of(robot, "cycles") > 3; }));
  (void)robot.close();
  first.join();
  second.join();
  EXPECT_EQ(invokes.invoke("{}", timeout).code(), errc::closed);
}

TEST(lanes, are_refused_where_an_option_is_out_of_its_range) {
  auto robot = endpoint::listen(0, quick()).value();
  EXPECT_EQ(robot.open_lane({.depth = 0}).error(),
            (rowe::error{errc::bad_argument, 0, 1, rowe::argument::depth}));
  EXPECT_EQ(robot.open_lane({.inbox_depth = 5000}).error(),
            (rowe::error{errc::bad_argument, 5000, 4096, rowe::argument::inbox_depth}));
  EXPECT_EQ(robot.open_lane({.calls = 0}).code(), errc::bad_argument);
  EXPECT_EQ(robot.open_lane({.depth = 4096, .text_bytes_max = 4096}).code(), errc::handle_memory);
  (void)robot.close();
  EXPECT_EQ(robot.open_lane().code(), errc::closed);
}

// What a handle that is gone has sent is in the endpoint's slots and in its lane, and waits for ever.
TEST(lanes, are_opened_while_others_wait_for_a_peer_that_never_comes) {
  const rowe::tests::watchdog dog{"opening lanes"};
  auto options = quick();
  options.limits.small_slots = 4;
  options.limits.large_slots = 1;
  auto robot = endpoint::listen(0, options).value();
  {
    auto gone = robot.open_lane({.depth = 16, .calls = 1}).value();
    for (int sent = 0; sent < 16;) sent += gone.try_send("{}", rowe::rt::for_ever).has_value();
  }
  for (int i = 0; i < 100; ++i) {
    const auto lane = robot.open_lane();
    ASSERT_TRUE(lane) << i << " " << lane.error().name();
  }
}

TEST(lanes, reuse_the_memory_of_handles_that_are_gone) {
  rowe::endpoint_options few;
  few.limits.handles_max = 1;
  few.limits.handle_bytes = 200 * 1024;
  auto robot = endpoint::listen(0, few).value();
  for (int i = 0; i < 20; ++i) {
    auto lane = robot.open_lane({.depth = 8, .inbox_depth = 8, .calls = 8});
    ASSERT_TRUE(lane) << i << " " << lane.error().name();
    (void)lane->try_send("{}", 1ms);
    (void)lane->start("{}", 1s, clock_now());
  }
}

// ---- room

// Sends so many, in their order, each as soon as there is room.
template <class Handle>
void send_all(Handle& by, int count) {
  for (int i = 0; i < count; ++i) {
    for (;;) {
      const rowe::status done = by.try_send(message("n", i), rowe::rt::for_ever);
      if (done) break;
      ASSERT_EQ(done.code(), errc::full);
      ASSERT_TRUE(by.wait_room(timeout)) << "at " << i;
    }
  }
}

template <class Handle>
void take_all(Handle& from, int count) {
  for (int i = 0; i < count; ++i) {
    const auto got = from.receive(timeout);
    ASSERT_TRUE(got) << i << ": " << got.error().name();
    ASSERT_TRUE(says(got->value(), R"({"n":)" + std::to_string(i) + "}")) << got->value();
  }
}

// More than all queues, rings and kernels between the two hold: TCP waits, and then the one who sends.
constexpr int many = 30'000;

TEST(room, is_waited_for_by_a_lane_until_the_other_side_takes) {
  const rowe::tests::watchdog dog{"a lane that waits for room", 120s};
  auto hop = endpoint::listen(0, quick()).value();
  auto taker = hop.open_lane({.inbox_depth = 4}).value();
  auto robot = connected(hop);
  auto lane = robot.open_lane({.depth = 8}).value();
  std::thread sends{[&] { send_all(lane, many); }};
  take_all(taker, many);
  sends.join();
  EXPECT_GT(count_of(robot, "full"), 0U) << "else nobody waited";
  for (const char* lost : {"inbox_full", "outbox_full", "no_slot"})
    EXPECT_EQ(count_of(hop, lost) + count_of(robot, lost), 0U) << lost;
}

TEST(room, is_waited_for_by_a_thread_until_the_other_side_takes) {
  const rowe::tests::watchdog dog{"a thread that waits for room", 120s};
  auto hop = endpoint::listen(0, answering()).value(); // what comes before receive() is called waits for it
  auto robot = connected(hop);
  std::thread sends{[&] { send_all(robot, many); }};
  take_all(hop, many);
  sends.join();
  for (const char* lost : {"inbox_full", "outbox_full", "no_slot"})
    EXPECT_EQ(count_of(hop, lost) + count_of(robot, lost), 0U) << lost;
}

TEST(room, is_there_at_once_where_nothing_waits) {
  auto hop = endpoint::listen(0, quick()).value();
  auto lane = hop.open_lane().value();
  auto robot = connected(hop);
  EXPECT_TRUE(lane.wait_room(0ns));
  EXPECT_TRUE(hop.wait_room(0ns));
  ASSERT_TRUE(hop.wait_peer(timeout));
  const auto peers = hop.connections();
  ASSERT_EQ(peers.size(), 1U);
  EXPECT_TRUE(lane.wait_room(0ns, peers[0].id));
  EXPECT_TRUE(hop.wait_room(0ns, peers[0].id));
  (void)robot.close();
  EXPECT_TRUE(eventually([&] { return hop.peers() == 0; }));
  EXPECT_EQ(lane.wait_room(timeout, peers[0].id).code(), errc::peer_lost);
  EXPECT_EQ(hop.wait_room(timeout, peers[0].id).code(), errc::peer_lost);
  (void)hop.close();
  EXPECT_EQ(lane.wait_room(timeout).code(), errc::closed);
  EXPECT_EQ(hop.wait_room(timeout).code(), errc::closed);
  EXPECT_EQ(rowe::lane{}.wait_room(timeout).code(), errc::misuse);
}

// Nobody takes what these send.
TEST(room, ends_by_time_and_by_closing) {
  const rowe::tests::watchdog dog{"who waits for room until the endpoint closes"};
  auto robot = endpoint::connect("ws://127.0.0.1:1", quick()).value(); // nobody is there
  auto lane = robot.open_lane({.depth = 4}).value();
  const auto fill = [](auto& by) {
    rowe::status room;
    do {
      while (by.try_send("{}", rowe::rt::for_ever)) continue;
      room = by.wait_room(50ms); // the service thread may only have been slow
    } while (room);
    EXPECT_EQ(room.code(), errc::timed_out);
  };
  fill(lane);
  fill(robot);
  std::thread waits{[&] { EXPECT_EQ(robot.wait_room(rowe::rt::for_ever).code(), errc::closed); }};
  std::thread closes{[&] { (void)robot.close(); }};
  EXPECT_EQ(lane.wait_room(rowe::rt::for_ever).code(), errc::closed);
  waits.join();
  closes.join();
}

} // namespace
} // namespace lane_messages_test
