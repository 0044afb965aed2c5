// SPDX-License-Identifier: Apache-2.0
// In steady state nothing in the whole process allocates for a message: neither publisher, core, transport
// and libwebsockets of the server, nor those of the client that reads. Counted by the tripwire's malloc, in
// all threads.
#include <rowe/rowe.hpp>

#include <gtest/gtest.h>

#include <rowe/rt/tripwire.hpp>

#include <string>

struct pose {
  double x, y, heading;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y, &pose::heading>{};

namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;
constexpr int warm_up = 500;
constexpr int measured = 5000;

TEST(allocations, are_none_for_a_message_from_publisher_to_subscriber_over_sockets) {
  rowe::endpoint_options options;
  options.relay = true;
  options.limits.lane_bytes = 2 * 1024 * 1024;
  auto robot = rowe::endpoint::listen(0, options).value();
  auto odom = robot.advertise<pose>("/odom").value();
  auto viewer = rowe::endpoint::connect("ws://127.0.0.1:" + std::to_string(robot.port()), options).value();
  auto seen = viewer.subscribe<rowe::json_text>("/odom").value();
  auto command = viewer.advertise<rowe::json_text>("/cmd").value();
  auto commanded = robot.subscribe<rowe::json_text>("/cmd").value();
  ASSERT_TRUE(viewer.wait_peer(patience));
  const auto until = rowe::rt::monotonic_clock::now() + patience;
  while (!odom.wanted()) ASSERT_LT(rowe::rt::monotonic_clock::now(), until);

  int went = 0;
  int came = 0;
  const auto exchange = [&](int count) {
    for (int i = 0; i < count; ++i) {
      if (!odom.publish({0.001 * i, 1e-9 * i, 3.0 / (i + 1)})) break;
      if (!seen.take(patience)) break;
      ++went;
      if (!command.publish(R"({"linear":0.5})")) break;
      if (!commanded.take(patience)) break;
      ++came;
    }
  };
  exchange(warm_up);
  const std::uint64_t before = rowe::rt::tripwire::process_allocations();
  exchange(measured);
  const std::uint64_t after = rowe::rt::tripwire::process_allocations();
  EXPECT_EQ(went, warm_up + measured);
  EXPECT_EQ(came, warm_up + measured);
  EXPECT_EQ(after - before, 0U);
}

} // namespace
