// SPDX-License-Identifier: Apache-2.0
// Parameters of an endpoint that listens: a loop reads what another thread's peer writes, under each policy.
#include <atomic>
#include <thread>

#include "endpoints.hpp"

namespace parameters_test {
namespace {

using namespace endpoints;
using rowe::errc;
using rowe::json_text;

std::string set(rowe::endpoint& by, std::string_view name, std::string_view value) {
  auto calls = by.client<json_text, json_text>("/rosapi/set_param").value();
  const std::string args = R"({"name":")" + std::string{name} + R"(","value":")" + std::string{value} + "\"}";
  const auto answer = calls.call(args, timeout);
  return answer ? std::string{answer->value()} : answer.error().message();
}

TEST(parameters, of_a_loop_are_set_by_peers_and_by_its_program) {
  for (const auto policy : {rowe::idle::poll, rowe::idle::wake}) {
    auto options = quick();
    options.idle_policy = policy;
    auto robot = rowe::endpoint::listen(0, options).value();
    auto gain = robot.parameter<double>("/gain", 1, {0, 1e6}).value();
    auto peer = connected(robot);
    std::atomic<bool> over{false};
    std::atomic<bool> torn{false};
    std::thread loop{[&] {
      double last = 1;
      while (!over) {
        const double now = gain.get();
        if (now < last) torn = true;
        last = now;
        if (now < 50) continue;
        EXPECT_TRUE(gain.set(1000));
        over = true;
      }
    }};
    for (int i = 2; i <= 50; ++i)
      EXPECT_NE(set(peer, "/gain", std::to_string(i)).find("true"), std::string::npos);
    loop.join();
    EXPECT_FALSE(torn);
    auto asks = peer.client<json_text, json_text>("/rosapi/get_param").value();
    for (;;) { // the service thread takes it in its next cycle
      const auto answer = asks.call(R"({"name":"gain"})", timeout);
      ASSERT_TRUE(answer);
      if (answer->value().find("\"1000\"") != std::string_view::npos) break;
    }
  }
}

TEST(parameters, say_what_is_wrong_with_them) {
  auto options = quick();
  options.limits.parameters_max = 2;
  auto robot = rowe::endpoint::listen(0, options).value();
  EXPECT_EQ(robot.parameter<bool>("", true).code(), errc::bad_argument);
  EXPECT_EQ(robot.parameter<bool>("/", true).code(), errc::bad_argument);
  EXPECT_EQ(robot.parameter<bool>("/\xff", true).code(), errc::not_utf8);
  EXPECT_EQ(robot.parameter<bool>(std::string(300, 'x'), true).code(), errc::bad_argument);
  EXPECT_EQ(robot.parameter<bool>("/rowe/mine", true).code(), errc::reserved_topic);
  EXPECT_EQ((robot.parameter<int>("/a", 7, {0, 5}).code()), errc::out_of_range);
  auto a = robot.parameter<int>("/a", 3, {0, 5}).value();
  EXPECT_EQ(robot.parameter<bool>("a", true).code(), errc::parameter_taken);
  auto b = robot.parameter<bool>("/b", true).value();
  const auto third = robot.parameter<bool>("/c", true);
  EXPECT_EQ(third.code(), errc::too_many_parameters);
  EXPECT_EQ(third.error().message(), "2 parameters exist; the limit `parameters_max` is 2");
  EXPECT_EQ(a.set(6).code(), errc::out_of_range);
  EXPECT_TRUE(robot.close());
  EXPECT_EQ(a.set(4).code(), errc::closed);
  EXPECT_EQ(a.get(), 3);
  EXPECT_EQ(robot.parameter<bool>("/d", true).code(), errc::closed);
}

// A handle that goes and comes takes no more places than one.
TEST(parameters, can_be_replaced_for_ever) {
  auto options = quick();
  options.limits.parameters_max = 1;
  auto robot = rowe::endpoint::listen(0, options).value();
  for (int i = 0; i < 50; ++i) {
    auto made = robot.parameter<int>("/a", i);
    ASSERT_TRUE(made) << i << " " << made.error().message();
    EXPECT_EQ(made->get(), i);
  }
}

} // namespace
} // namespace parameters_test
