// SPDX-License-Identifier: Apache-2.0
// What ROS's clients ask about nodes: who publishes, subscribes and provides what.
#include "access_fixture.hpp"

#include <string>
#include <string_view>

namespace core_graph_test {
namespace {

using namespace access_fixture;
using rowe::detail::pair_kind;

// The arm may also ask, but sees and calls its own only.
rowe::endpoint_options with_an_asking_arm() {
  rowe::endpoint_options options = with_roles();
  options.access.roles[0].call = {"/arm/*", "/rosapi/**"};
  return options;
}

struct graph : access {
  static constexpr std::string_view arm_at = "10.0.0.9:1";

  peer& arm = comes("arm", arm_at);
  peer& page = comes("observer");

  graph() : access{with_an_asking_arm()} {
    on.offer(pair_kind::publish_text, "/odom", 100);
    on.offer(pair_kind::subscribe_text, "/cmd_vel", 100);
    arm.say(R"({"op":"advertise","topic":"/arm/joints","type":"sensor_msgs/msg/JointState"})");
    arm.say(R"({"op":"subscribe","topic":"/arm/goal"})");
    arm.say(R"({"op":"subscribe","topic":"arm/goal"})"); // one node, by both spellings
    arm.say(R"({"op":"advertise_service","service":"/arm/open","type":"std_srvs/Trigger"})");
    on.cycles(2);
  }
  // The members of the answer.
  std::string ask(peer& by, std::string_view service, std::string_view args = "{}") {
    (void)by.hear();
    const std::string answer =
        answer_to(by, R"({"op":"call_service","service":"/rosapi/)" + std::string{service} + R"(","args":)" +
                          std::string{args} + "}");
    const auto values = rowe::json::find(rowe::json::root(answer).raw, "values");
    return values ? std::string{values->raw} : answer;
  }
};

TEST_F(graph, has_the_endpoint_and_its_peers_as_nodes) {
  EXPECT_EQ(ask(page, "nodes"), R"({"nodes":["robot","10.0.0.9:1","10.0.0.7:50000"]})");
  EXPECT_EQ(ask(arm, "nodes"), R"({"nodes":["robot","10.0.0.9:1"]})"); // it does not see everything
}

TEST_F(graph, says_what_a_node_does) {
  EXPECT_EQ(ask(page, "node_details", R"({"node":"10.0.0.9:1"})"),
            R"({"subscribing":["/arm/goal"],"publishing":["/arm/joints"],"services":[]})"); // may not call it
  EXPECT_EQ(ask(comes("supervisor"), "node_details", R"({"node":"10.0.0.9:1"})"),
            R"({"subscribing":["/arm/goal"],"publishing":["/arm/joints"],"services":["/arm/open"]})");
  EXPECT_EQ(ask(page, "node_details", R"({"node":"/robot"})"),
            R"({"subscribing":["/cmd_vel"],"publishing":["/rowe/stats","/odom"],"services":[]})");
  EXPECT_EQ(ask(page, "node_details", R"({"node":"/nobody"})"),
            R"({"subscribing":[],"publishing":[],"services":[]})");
  EXPECT_EQ(ask(arm, "node_details", R"({"node":"10.0.0.7:50000"})"),
            R"({"subscribing":[],"publishing":[],"services":[]})");
  EXPECT_EQ(ask(arm, "node_details", R"({"node":"robot"})"),
            R"({"subscribing":[],"publishing":[],"services":[]})"); // nothing that it may see
}

TEST_F(graph, says_who_has_a_topic_or_a_service) {
  EXPECT_EQ(ask(page, "subscribers", R"({"topic":"/arm/goal"})"), R"({"subscribers":["10.0.0.9:1"]})");
  EXPECT_EQ(ask(page, "subscribers", R"({"topic":"cmd_vel"})"), R"({"subscribers":["robot"]})");
  EXPECT_EQ(ask(page, "subscribers", R"({"topic":"/none"})"), R"({"subscribers":[]})");
  EXPECT_EQ(ask(arm, "subscribers", R"({"topic":"/cmd_vel"})"), R"({"subscribers":[]})");
  EXPECT_EQ(ask(page, "service_node", R"({"service":"/rowe/stats"})"), R"({"node":"robot"})");
  EXPECT_EQ(ask(page, "service_node", R"({"service":"/arm/open"})"), R"({"node":""})"); // it may not call it
  peer& boss = comes("supervisor");
  EXPECT_EQ(ask(boss, "service_node", R"({"service":"arm/open"})"), R"({"node":"10.0.0.9:1"})");
  EXPECT_EQ(ask(boss, "service_providers", R"({"service":"/arm/open"})"), R"({"providers":["10.0.0.9:1"]})");
  EXPECT_EQ(ask(boss, "service_providers", R"({"service":"/none"})"), R"({"providers":[]})");
}

TEST_F(graph, finds_by_type_in_either_spelling) {
  for (const char* const type : {"sensor_msgs/JointState", "sensor_msgs/msg/JointState"})
    EXPECT_EQ(ask(page, "topics_for_type", R"({"type":")" + std::string{type} + "\"}"),
              R"({"topics":["/arm/joints"]})");
  EXPECT_EQ(ask(page, "topics_for_type", R"({"type":"a/B"})"), R"({"topics":[]})");
  EXPECT_EQ(ask(comes("supervisor"), "services_for_type", R"({"type":"std_srvs/srv/Trigger"})"),
            R"({"services":["/arm/open"]})");
  EXPECT_EQ(ask(page, "topics_and_raw_types").find(R"({"topics":["/rowe/stats",)"), 0U);
  EXPECT_EQ(ask(page, "action_servers"), R"({"action_servers":[]})");
}

TEST_F(graph, knows_the_time_in_the_words_of_both_ros) {
  const std::string time = ask(page, "get_time");
  const auto at = rowe::json::find(time, "time");
  ASSERT_TRUE(at);
  for (const auto& [one, other] : {std::pair{"secs", "sec"}, {"nsecs", "nanosec"}})
    EXPECT_EQ(rowe::json::find(at->raw, one)->raw, rowe::json::find(at->raw, other)->raw);
  EXPECT_GE(rowe::json::to_integer(*rowe::json::find(at->raw, "secs")).value(), 0);
}

} // namespace
} // namespace core_graph_test
