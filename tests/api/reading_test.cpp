// SPDX-License-Identifier: Apache-2.0
// What was received is read where it lies: by each handle that has text, and by ordinary threads.
#include <gtest/gtest.h>

#include <string>

#include "endpoints.hpp"

struct reading_pose {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<reading_pose> = rowe::fields<&reading_pose::x, &reading_pose::y>{};

namespace reading_test {
namespace {

using namespace endpoints;
using rowe::endpoint;
using rowe::errc;
using rowe::json_text;
using rowe::message;

constexpr std::string_view walk =
    R"({"path":[{"x":1,"y":2},{"x":3,"y":4.5}],"name":"\u00fcber","done":false})";

// The same of whatever has it.
template <class Holder>
void expect_walk_in(const Holder& it) {
  EXPECT_EQ(it.template get<int>("path[1].x").value(), 3);
  EXPECT_EQ(it.template as<reading_pose>("path[1]").value().y, 4.5);
  EXPECT_FALSE(it.template get<bool>("done").value());
  EXPECT_EQ(it.template get<std::string>("name").value(), "\u00fcber");
  EXPECT_TRUE(it.find("name")->says("\u00fcber"));
  EXPECT_FALSE(it.find("path[2]"));
  char scratch[8];
  EXPECT_EQ(it.template get<std::string_view>("name", scratch).value(), "\u00fcber");
  EXPECT_EQ(it.template get<double>("path[1].z").error().message(),
            "the member \"path[1].z\" is missing; a number is wanted");
  std::string names;
  for (const auto [name, value] : it.members()) {
    if (name.says("path") || name.says("name") || name.says("done")) names.append(name.text());
  }
  EXPECT_EQ(names, R"("path""name""done")");
  EXPECT_EQ(it.elements().begin(), it.elements().end());
  EXPECT_EQ(it.json().find("path[0]")->text(), R"({"x":1,"y":2})");
}

TEST(reading, reads_what_an_ordinary_thread_received) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  ASSERT_TRUE(viewer.send(walk, timeout));
  const auto heard = robot.receive(timeout);
  ASSERT_TRUE(heard) << heard.error().name();
  expect_walk_in(*heard);
}

TEST(reading, reads_replies_to_ordinary_threads_and_to_lanes) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  auto lane = viewer.open_lane().value();
  const auto at_robot = answering_thread(robot, [&robot](const rowe::received& call) {
    const auto a = call.get<int>("a"), b = call.get<int>("b");
    if (a && b) (void)robot.try_reply(call, message("sum", *a + *b));
  });
  const message question{"service", "add-two-numbers", "a", 38, "b", 4};
  ASSERT_TRUE(eventually([&] { // refused until the answering thread has called receive()
    const auto reply = viewer.invoke(question, timeout);
    return reply && reply->get<int>("sum").value() == 42;
  }));
  const auto reply = lane.invoke(question, timeout);
  ASSERT_TRUE(reply) << reply.error().name();
  EXPECT_EQ(reply->get<int>("sum").value(), 42);
  EXPECT_EQ(reply->get<int>("result").code(), errc::missing_member);
}

TEST(reading, reads_topics_and_services_of_text) {
  auto robot = endpoint::listen(0, quick()).value();
  auto viewer = connected(robot);
  auto seen = robot.subscribe<json_text>("/walk").value();
  auto walks = viewer.advertise<json_text>("/walk").value();
  ASSERT_TRUE(eventually([&] { // refused until the viewer knows of the subscription
    (void)walks.publish(walk);
    const auto taken = seen.take(10ms);
    if (taken) expect_walk_in(*taken);
    return taken.has_value();
  }));

  auto service = robot.serve<json_text, json_text>("/echo").value();
  auto client = viewer.client<json_text, json_text>("/echo").value();
  ASSERT_TRUE(eventually([&] {
    const auto id = client.start(walk, timeout, rowe::rt::monotonic_clock::now());
    auto asked = service.next(1s);
    if (!id || !asked) return false;
    expect_walk_in(*asked);
    (void)service.reply(*asked, asked->value());
    return true;
  }));
  ASSERT_TRUE(eventually([&] {
    const auto answer = client.try_finish();
    if (!answer || !answer->reply) return false;
    expect_walk_in(*answer->reply);
    return true;
  }));
}

} // namespace
} // namespace reading_test
