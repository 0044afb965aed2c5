// SPDX-License-Identifier: Apache-2.0
// Plain messages and calls between endpoints, from ordinary threads: the paper's functions. What they have in
// common with lanes: lane_messages_test.cpp.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "endpoints.hpp"

namespace ordinary_threads_test {
namespace {

using namespace endpoints;
using rowe::connection;
using rowe::endpoint;
using rowe::errc;
using rowe::error;
using rowe::message;

constexpr std::string_view sum_of_the_paper = R"({"sum":42})";

// Who answers add-two-numbers.
auto adding(endpoint& at) {
  return [&at](const rowe::received& call) {
    if (call.wants_reply()) (void)at.try_reply(call, message("sum", 42));
  };
}

TEST(ordinary_threads, carries_messages_both_ways) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  ASSERT_TRUE(viewer.send(R"({"from":"viewer"})", timeout));
  const auto heard = robot.receive(timeout);
  ASSERT_TRUE(heard) << heard.error().name();
  EXPECT_EQ(heard->value(), R"({"from":"viewer"})");
  EXPECT_FALSE(heard->wants_reply());
  ASSERT_TRUE(heard->from());
  // The viewer has used the plain format, so the robot may send to it, alone or as one of all.
  ASSERT_TRUE(robot.send(R"({"to":"you"})", timeout, heard->from()));
  ASSERT_TRUE(robot.send(R"({"to":"all"})", timeout));
  EXPECT_EQ(viewer.receive(timeout)->value(), R"({"to":"you"})");
  EXPECT_EQ(viewer.receive(timeout)->value(), R"({"to":"all"})");
}

TEST(ordinary_threads, invokes_the_services_of_the_other_end_in_both_directions) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  const auto at_robot = answering_thread(robot, adding(robot));
  const auto at_viewer = answering_thread(viewer, adding(viewer));
  ASSERT_TRUE(eventually([&] { // refused until the answering thread has called receive()
    const auto reply = viewer.invoke(message("service", "add-two-numbers", "a", 38, "b", 4), timeout);
    return reply && says(reply->value(), sum_of_the_paper);
  }));
  const auto peers = robot.connections();
  ASSERT_EQ(peers.size(), 1U);
  ASSERT_TRUE(eventually([&] {
    const auto reply = robot.invoke(message("service", "add-two-numbers"), timeout, peers[0].id);
    return reply && says(reply->value(), sum_of_the_paper);
  }));
}

TEST(ordinary_threads, shows_who_is_connected) {
  auto robot = endpoint::listen(0, quick()).value();
  EXPECT_TRUE(robot.connections().empty());
  connection first;
  {
    const auto viewer = connected(robot);
    ASSERT_TRUE(robot.wait_peer(timeout));
    const auto peers = robot.connections();
    ASSERT_EQ(peers.size(), 1U);
    first = peers[0].id;
    EXPECT_TRUE(first);
    EXPECT_TRUE(peers[0].address.starts_with("127.0.0.1:")) << peers[0].address;
  }
  ASSERT_TRUE(eventually([&] { return robot.connections().empty(); }));
  const auto viewer = connected(robot);
  ASSERT_TRUE(eventually([&] { return robot.connections().size() == 1; }));
  EXPECT_NE(robot.connections()[0].id, first);
  EXPECT_EQ(robot.send("{}", timeout, first).code(), errc::peer_lost);
  EXPECT_EQ(robot.try_send("{}", timeout, first).code(), errc::peer_lost);
  EXPECT_EQ(robot.invoke("{}", timeout, first).code(), errc::peer_lost);
}

TEST(ordinary_threads, says_what_does_not_fit) {
  auto options = quick();
  options.limits.door_slots = 2;
  options.limits.door_slot_bytes = 200;
  auto robot = endpoint::listen(0, options).value();
  const std::string text = R"({"a":")" + std::string(200, 'x') + "\"}";
  EXPECT_EQ(robot.send(text, timeout).error(),
            (error{errc::too_big, static_cast<std::int64_t>(text.size()), 200}));
  const rowe::message_of<8> overflowed{"name", "value"};
  EXPECT_EQ(robot.send(overflowed, timeout).error(), (error{errc::too_big, 9, 8}));
  EXPECT_EQ(robot.try_send(overflowed, timeout).code(), errc::too_big);
  EXPECT_EQ(robot.invoke(overflowed, timeout).code(), errc::too_big);
}

TEST(ordinary_threads, says_full_when_all_its_slots_are_taken) {
  auto options = quick();
  options.limits.door_slots = 2;
  auto robot = endpoint::listen(0, options).value();
  std::vector<std::thread> waiting;
  for (int i = 0; i < 2; ++i) {
    waiting.emplace_back([&] { // for a peer, which never comes
      rowe::status sent;
      do sent = robot.send("{}", -1ns);
      while (sent.code() == errc::full); // the slots are also those of try_send() below
      EXPECT_EQ(sent.code(), errc::closed);
    });
  }
  rowe::status refused;
  EXPECT_TRUE(eventually([&] { return (refused = robot.try_send("{}", 0ns)).code() == errc::full; }));
  EXPECT_EQ(refused.error().limit, 2);
  (void)robot.close();
  for (auto& one : waiting) one.join();
}

TEST(ordinary_threads, keeps_calls_for_receive_from_the_start_by_option) {
  auto robot = endpoint::listen(0, answering()).value();
  auto viewer = connected(robot);
  std::thread asks{[&] {
    const auto reply = viewer.invoke(message("service", "anything"), timeout);
    ASSERT_TRUE(reply) << reply.error().name();
    EXPECT_TRUE(says(reply->value(), R"({"done":true})")) << reply->value();
  }};
  const auto call = robot.receive(timeout);
  ASSERT_TRUE(call);
  EXPECT_TRUE(call->wants_reply());
  EXPECT_TRUE(call->value().find(R"("anything")") != std::string_view::npos) << call->value();
  EXPECT_TRUE(robot.reply(*call, message("done", true)));
  asks.join();
}

TEST(ordinary_threads, times_out_where_no_reply_comes_and_drops_the_late_one) {
  auto robot = endpoint::listen(0, answering()).value();
  auto viewer = connected(robot);
  ASSERT_TRUE(goes_out(viewer, [&] {
    const auto late = viewer.invoke(message("service", "slow"), 20ms);
    EXPECT_EQ(late.error(), (error{errc::timed_out, 0, 20'000'000}));
  }));
  const auto call = robot.receive(timeout);
  ASSERT_TRUE(call);
  (void)robot.reply(*call, "{}"); // expired, where the viewer's time-out came along; else dropped there
  EXPECT_EQ(viewer.receive(20ms).code(), errc::timed_out);
}

TEST(ordinary_threads, does_not_reply_to_what_is_no_call_of_its_own) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  ASSERT_TRUE(viewer.send("{}", timeout));
  const auto plain = robot.receive(timeout);
  ASSERT_TRUE(plain);
  EXPECT_EQ(robot.reply(*plain, "{}").code(), errc::misuse);
  EXPECT_EQ(robot.try_reply(*plain, "{}").code(), errc::misuse);
  EXPECT_EQ(robot.refuse(*plain, "no").code(), errc::misuse);
  EXPECT_EQ(viewer.reply(*plain, "{}").code(), errc::misuse);
}

TEST(ordinary_threads, says_peer_lost_to_replies_whose_asker_is_gone) {
  auto robot = endpoint::listen(0, answering()).value();
  std::optional<endpoint> viewer{connected(robot)};
  std::thread asks{[&] { (void)viewer->invoke(message("service", "slow"), timeout); }};
  const auto call = robot.receive(timeout);
  ASSERT_TRUE(call);
  (void)viewer->close();
  asks.join();
  ASSERT_TRUE(eventually([&] { return robot.connections().empty(); }));
  EXPECT_EQ(robot.reply(*call, "{}").code(), errc::peer_lost);
  EXPECT_EQ(robot.try_reply(*call, "{}").code(), errc::peer_lost);
  EXPECT_EQ(robot.refuse(*call, "no").code(), errc::peer_lost);
}

TEST(ordinary_threads, says_closed_to_everybody_once_it_is) {
  auto robot = endpoint::listen(0, quick()).value();
  std::vector<std::thread> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.emplace_back([&] { EXPECT_EQ(robot.receive(-1ns).code(), errc::closed); });
    waiting.emplace_back([&] { EXPECT_EQ(robot.send("{}", -1ns).code(), errc::closed); });
  }
  EXPECT_TRUE(eventually([&] { return count_of(robot, "cycles") > 3; }));
  (void)robot.close();
  for (auto& one : waiting) one.join();
  EXPECT_EQ(robot.send("{}", timeout).code(), errc::closed);
  EXPECT_EQ(robot.try_send("{}", timeout).code(), errc::closed);
  EXPECT_EQ(robot.invoke("{}", timeout).code(), errc::closed);
  EXPECT_EQ(robot.receive(timeout).code(), errc::closed);
  EXPECT_EQ(robot.receive(0ns).code(), errc::closed);
}

TEST(ordinary_threads, lets_what_was_received_outlive_the_endpoint) {
  std::optional<rowe::received> kept;
  {
    auto robot = endpoint::listen(0, quick()).value();
    auto viewer = connected(robot);
    ASSERT_TRUE(viewer.send(R"({"n":1})", timeout));
    auto heard = robot.receive(timeout);
    ASSERT_TRUE(heard);
    kept.emplace(std::move(*heard));
  }
  EXPECT_EQ(kept->value(), R"({"n":1})");
}

TEST(ordinary_threads, drops_what_was_not_received_in_time) {
  auto options = quick();
  options.inbound_ttl = 1ms;
  auto robot = endpoint::listen(0, options).value();
  auto viewer = connected(robot);
  ASSERT_TRUE(viewer.send(R"({"n":1})", timeout));
  ASSERT_TRUE(eventually([&] { return count_of(robot, "messages_in") > 0; }));
  const auto arrived = rowe::rt::monotonic_clock::now();
  ASSERT_TRUE(eventually([&] { return rowe::rt::monotonic_clock::now() > arrived + 2ms; }));
  EXPECT_TRUE(eventually([&] { // it is dropped by whoever asks; the counter may run ahead of the message
    EXPECT_EQ(robot.receive(0ns).code(), errc::timed_out);
    return count_of(robot, "inbound_expired") == 1;
  }));
}

TEST(ordinary_threads, serves_many_threads_at_once) {
  auto robot = endpoint::listen(0, answering()).value();
  auto viewer = connected(robot);
  const auto echo = [&](const rowe::received& call) {
    if (!call.wants_reply()) return;
    const std::string_view text = call.value();
    const std::size_t at = text.find(R"("n":)");
    ASSERT_NE(at, std::string_view::npos);
    (void)robot.try_reply(call, message("n", std::stoi(std::string{text.substr(at + 4)})));
  };
  const auto first = answering_thread(robot, echo);
  const auto second = answering_thread(robot, echo);
  std::vector<std::thread> asking;
  std::atomic<int> answered{0};
  for (int t = 0; t < 4; ++t) {
    asking.emplace_back([&, t] {
      for (int i = 0; i < 200; ++i) {
        const int n = 1000 * t + i;
        const auto reply = viewer.invoke(message("service", "echo", "n", n), timeout);
        ASSERT_TRUE(reply) << reply.error().name();
        ASSERT_TRUE(says(reply->value(), message("n", n).text())) << reply->value();
        ++answered;
      }
    });
  }
  for (auto& one : asking) one.join();
  EXPECT_EQ(answered.load(), 800);
}

} // namespace
} // namespace ordinary_threads_test
