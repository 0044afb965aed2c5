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

std::size_t count_in(std::string_view text, std::string_view what) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += what.size()) ++count;
  return count;
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
    arm.tell(R"({"op":"advertise_service","service":"/arm/open","type":"std_srvs/Trigger"})", 2);
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
  const std::string robot = ask(page, "node_details", R"({"node":"/robot"})");
  EXPECT_TRUE(robot.starts_with(
      R"({"subscribing":["/cmd_vel"],"publishing":["/rowe/stats","/odom"],"services":["/rowe/stats",)"))
      << robot;
  EXPECT_FALSE(has(robot, "/arm/open"));
  EXPECT_EQ(ask(page, "node_details", R"({"node":"/nobody"})"),
            R"({"subscribing":[],"publishing":[],"services":[]})");
  EXPECT_EQ(ask(arm, "node_details", R"({"node":"10.0.0.7:50000"})"),
            R"({"subscribing":[],"publishing":[],"services":[]})");
  const std::string to_arm = ask(arm, "node_details", R"({"node":"robot"})");
  EXPECT_TRUE(to_arm.starts_with(R"({"subscribing":[],"publishing":[],"services":["/rosapi/topics",)"))
      << "only what it may see: " << to_arm;
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

TEST_F(graph, has_the_other_services_of_ros_servers) {
  peer& boss = comes("supervisor");
  EXPECT_EQ(ask(boss, "service_host", R"({"service":"/arm/open"})"), R"({"host":"10.0.0.9"})");
  EXPECT_EQ(ask(page, "service_host", R"({"service":"/rosapi/nodes"})"), R"({"host":"robot"})");
  EXPECT_EQ(ask(page, "service_host", R"({"service":"/nobody"})"), R"({"host":""})");
  EXPECT_EQ(ask(page, "service_node", R"({"service":"rosapi/nodes"})"), R"({"node":"robot"})");
  EXPECT_EQ(ask(page, "services_for_type", R"({"type":"rosapi/Nodes"})"),
            R"({"services":["/rosapi/nodes"]})");
  peer& docks = comes("peer", "10.0.0.6:6");
  docks.tell(R"({"op":"advertise_action","action":"/dock","type":"a/action/Dock"})");
  EXPECT_EQ(ask(boss, "action_type", R"({"action":"dock"})"), R"({"type":"a/action/Dock"})");
  EXPECT_EQ(ask(boss, "action_type", R"({"action":"/arm/open"})"), R"({"type":""})") << "that is a service";
  EXPECT_EQ(ask(page, "action_type", R"({"action":"/dock"})"), R"({"type":""})")
      << "it may not send it goals";
}

TEST_F(graph, says_which_interfaces_there_are_each_once_and_how_types_are_spelled) {
  const auto types = [&] { return ask(page, "interfaces", "{}"); };
  peer& other = comes("peer", "10.0.0.6:6");
  other.say(R"({"op":"advertise","topic":"/x","type":"a_msgs/msg/Thing"})");
  other.say(R"({"op":"advertise","topic":"/y","type":"a_msgs/Thing"})");
  on.cycle();
  EXPECT_EQ(count_in(types(), "Thing"), 1U) << types();
  EXPECT_EQ(count_in(types(), "\"rosapi/Interfaces\""), 1U) << types();
  EXPECT_EQ(ask(page, "get_ros_version", "{}"), R"({"version":2,"distro":"rowe"})");
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

// ---- names that fill a message

struct graph_of_long_names : access {
  peer& page = comes("supervisor");
  peer& rude = comes("driver", "10.0.0.8:1");

  graph_of_long_names() : access{with_limits(with_roles(), &limits::topic_bytes_max, 3000)} {}
  std::string ask(std::string_view service) {
    (void)page.hear();
    return answer_to(page, R"({"op":"call_service","service":"/rosapi/)" + std::string{service} + "\"}");
  }
};

TEST_F(graph_of_long_names, lists_as_many_topics_as_fit_and_says_how_many_do_not) {
  on.offer(pair_kind::publish_text, "/odom", 100);
  for (const char c : {'a', 'b', 'c', 'd'})
    rude.say(R"({"op":"advertise","topic":"/)" + std::string(2900, c) + R"(","type":"a/B"})");
  rude.say(R"({"op":"subscribe","topic":"/short"})");
  on.cycles(3);
  const std::string answer = ask("topics");
  EXPECT_TRUE(has(answer, R"("result":true)"));
  for (const std::string_view name : {"\"/odom\"", "\"/short\"", "\"/rowe/stats\""})
    EXPECT_TRUE(has(answer, name)) << name;
  EXPECT_EQ(count_in(answer, "\"a/B\""), 2U) << "types are those of the names";
  EXPECT_TRUE(has(answer, R"("left_out":2)"));
  EXPECT_EQ(on.count(counter::names_left_out), 2U);
}

TEST_F(graph_of_long_names, lists_as_many_services_as_fit) {
  const auto provide = [](peer& by, const std::string& name) {
    by.say(R"({"op":"advertise_service","service":"/arm/)" + name + R"(","type":"a/B"})");
  };
  peer& first = comes("arm", "10.0.0.9:1");
  peer& second = comes("arm", "10.0.0.9:2");
  provide(first, std::string(2900, 'a'));
  provide(first, std::string(2900, 'b'));
  provide(second, std::string(2900, 'c'));
  provide(second, "short");
  on.cycles(3);
  const std::string answer = ask("services");
  EXPECT_TRUE(has(answer, R"("result":true)"));
  EXPECT_TRUE(has(answer, "\"/arm/short\""));
  EXPECT_TRUE(has(answer, R"("left_out":1)")) << answer.size();
  EXPECT_EQ(on.count(counter::names_left_out), 1U);
}

} // namespace
} // namespace core_graph_test
