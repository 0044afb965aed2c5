// SPDX-License-Identifier: Apache-2.0
// The connection graph as clients of Foxglove's protocol are told of it: all at once, and then what changes.
#include "access_fixture.hpp"

#include <string>

#include "wire/graph_view.hpp"

namespace core_foxglove_graph_test {
namespace {

using namespace access_fixture;
using rowe::detail::pair_kind;
using rowe::service::graph_period;
using rowe::service::side;
using holders = graph_view::holders;

constexpr std::string_view subscribe = R"({"op":"subscribeConnectionGraph"})";
constexpr std::string_view unsubscribe = R"({"op":"unsubscribeConnectionGraph"})";

rowe::endpoint_options with_viewers() {
  rowe::endpoint_options options = with_roles();
  options.access.roles[0].call = {"/arm/*", "/rosapi/**"};
  options.access.roles.push_back({.name = "all",
                                  .subscribe = {"/**"},
                                  .publish = {"/**"},
                                  .advertise = {"/**"},
                                  .call = {"/**"},
                                  .provide = {"/**"}});
  options.access.identities.push_back({"all", "all", rowe::hash_token(token_of("all"))});
  options.silence_max = 1min;
  return options;
}

std::string update(std::string_view published, std::string_view subscribed, std::string_view services,
                   std::string_view gone_topics = {}, std::string_view gone_services = {}) {
  return R"({"op":"connectionGraphUpdate","publishedTopics":[)" + std::string{published} +
         R"(],"subscribedTopics":[)" + std::string{subscribed} + R"(],"advertisedServices":[)" +
         std::string{services} + R"(],"removedTopics":[)" + std::string{gone_topics} +
         R"(],"removedServices":[)" + std::string{gone_services} + "]}";
}

// The endpoint's own services that have numbers, but for those of the stop.
const std::string of_ros = R"({"name":"/rosapi/topics","providerIds":["robot"]},)"
                           R"({"name":"/rosapi/services","providerIds":["robot"]},)"
                           R"({"name":"/rosapi/topic_type","providerIds":["robot"]},)"
                           R"({"name":"/rosapi/publishers","providerIds":["robot"]},)"
                           R"({"name":"/rosapi/service_type","providerIds":["robot"]})";
const std::string own_services = R"({"name":"/rowe/stats","providerIds":["robot"]},)" + of_ros;

struct foxglove_graph : access {
  static constexpr std::string_view arm_at = "10.0.0.9:1";
  static constexpr std::string_view page_at = "10.0.0.8:2";

  explicit foxglove_graph(const rowe::endpoint_options& options = with_viewers()) : access{options} {}

  std::string heard(peer& by) {
    std::string all;
    for (const std::string& one : by.hear()) {
      if (graph_view::is_update(one)) all += one;
    }
    return all;
  }
  std::string say(peer& by, std::string_view text) { return answer_to(by, text); }
  void pause(int periods = 1) {
    for (int i = 0; i < periods * 26; ++i) on.cycle(graph_period / 25);
  }
  // Takes all updates, which must be sound.
  void see(peer& by, graph_view& into) {
    for (const std::string& one : by.hear()) {
      if (!graph_view::is_update(one)) continue;
      EXPECT_LE(one.size(), on.options.limits.message_bytes_max);
      EXPECT_EQ(into.take(one), "") << one;
    }
  }
};

TEST_F(foxglove_graph, is_told_whole_to_who_subscribes) {
  on.offer(pair_kind::publish_text, "/odom", 100);
  on.offer(pair_kind::subscribe_text, "/cmd_vel", 100);
  peer& arm = comes("arm", arm_at);
  arm.say(R"({"op":"advertise","topic":"/arm/joints"})");
  arm.say(R"({"op":"subscribe","topic":"/arm/goal"})");
  arm.say(R"({"op":"subscribe","topic":"arm/goal"})"); // one subscriber, by both spellings
  arm.tell(R"({"op":"advertise_service","service":"/arm/open"})", 2);
  peer& page = comes("all", page_at);
  page.say(R"({"op":"subscribe","topic":"/odom"})");
  page.say(R"({"op":"subscribe","topic":"/cmd_vel"})");
  peer& one = viewer("all");
  EXPECT_EQ(
      say(one, subscribe),
      update(
          R"({"name":"/rowe/stats","publisherIds":["robot"]},)"
          R"({"name":"/odom","publisherIds":["robot"]},{"name":"/arm/joints","publisherIds":["10.0.0.9:1"]})",
          R"({"name":"/odom","subscriberIds":["10.0.0.8:2"]},)"
          R"({"name":"/cmd_vel","subscriberIds":["robot","10.0.0.8:2"]},)"
          R"({"name":"/arm/goal","subscriberIds":["10.0.0.9:1"]})",
          R"({"name":"/arm/open","providerIds":["10.0.0.9:1"]},)" + own_services));
  pause(3);
  EXPECT_EQ(heard(one), "") << "nothing has changed";
  EXPECT_EQ(say(one, subscribe), "") << "it is told already";
}

TEST_F(foxglove_graph, is_told_as_publishers_subscribers_and_services_come_and_go) {
  peer& one = viewer("all");
  EXPECT_EQ(say(one, subscribe),
            update(R"({"name":"/rowe/stats","publisherIds":["robot"]})", "", own_services));
  peer& page = comes("all", page_at);
  page.say(R"({"op":"subscribe","topic":"/odom"})");
  pause();
  EXPECT_EQ(heard(one), update(R"({"name":"/odom","publisherIds":[]})",
                               R"({"name":"/odom","subscriberIds":["10.0.0.8:2"]})", ""));
  auto& odom = on.offer(pair_kind::publish_text, "/odom", 100, {.shared = true});
  pause();
  EXPECT_EQ(heard(one), update(R"({"name":"/odom","publisherIds":["robot"]})", "", ""));
  page.say(R"({"op":"advertise","topic":"/odom"})");
  page.say(R"({"op":"advertise_service","service":"/ask"})");
  pause();
  EXPECT_EQ(heard(one), update(R"({"name":"/odom","publisherIds":["robot","10.0.0.8:2"]})", "",
                               R"({"name":"/ask","providerIds":["10.0.0.8:2"]})"));
  odom.lifecycle.close();
  page.say(R"({"op":"unadvertise","topic":"/odom"})");
  page.say(R"({"op":"unadvertise_service","service":"/ask"})");
  pause();
  EXPECT_EQ(heard(one), update(R"({"name":"/odom","publisherIds":[]})", "", "", "", R"("/ask")"));
  page.say(R"({"op":"unsubscribe","topic":"/odom"})");
  pause();
  EXPECT_EQ(heard(one), update("", "", "", R"("/odom")"));
  page.say(R"({"op":"subscribe","topic":"/odom"})");
  pause();
  (void)heard(one);
  page.leave();
  pause();
  EXPECT_EQ(heard(one), update("", "", "", R"("/odom")"));
  EXPECT_EQ(say(one, unsubscribe), "");
  on.offer(pair_kind::publish_text, "/odom", 100);
  pause();
  EXPECT_EQ(heard(one), "");
}

TEST_F(foxglove_graph, has_what_the_endpoint_itself_publishes) {
  peer& one = viewer("all");
  (void)say(one, subscribe);
  stoppable_loop base{on};
  pause();
  EXPECT_EQ(heard(one), update(R"({"name":"/rowe/stop/state","publisherIds":["robot"]})",
                               R"({"name":"/rowe/stop/state","subscriberIds":[]})",
                               R"({"name":"/rowe/stop","providerIds":["robot"]},)"
                               R"({"name":"/rowe/stop/reset","providerIds":["robot"]},)"
                               R"({"name":"/rowe/stop/guard","providerIds":["robot"]},)"
                               R"({"name":"/rowe/stop/state","providerIds":["robot"]})"));
}

TEST_F(foxglove_graph, is_told_once_in_a_period_of_what_comes_and_goes_all_the_time) {
  peer& one = viewer("all");
  peer& busy = comes("all", page_at);
  (void)say(one, subscribe);
  pause();
  (void)heard(one);
  graph_view seen;
  constexpr int periods = 8;
  for (int i = 0; i < periods * 50; ++i) {
    busy.say(R"({"op":"advertise","topic":"/a"})");
    busy.say(R"({"op":"advertise_service","service":"/s"})");
    if (i % 74 < 37) busy.say(R"({"op":"unadvertise","topic":"/a"})");
    if (i % 58 < 29) busy.say(R"({"op":"unadvertise_service","service":"/s"})");
    on.cycle(graph_period / 50);
    (void)busy.hear();
    see(one, seen);
  }
  see(one, seen);
  EXPECT_GE(seen.updates, 4U);
  EXPECT_LE(seen.updates, periods + 1U);
}

TEST_F(foxglove_graph, is_told_as_often_to_who_asks_again_and_again) {
  peer& one = viewer("all");
  graph_view seen;
  constexpr int periods = 8;
  for (int i = 0; i < periods * 50; ++i) {
    one.say(subscribe);
    on.cycles(2, graph_period / 200);
    one.say(unsubscribe);
    on.cycles(2, graph_period / 200);
    see(one, seen);
  }
  see(one, seen);
  EXPECT_GE(seen.updates, 4U);
  EXPECT_LE(seen.updates, periods + 1U);
}

TEST_F(foxglove_graph, has_nothing_that_a_role_may_not_see) {
  on.offer(pair_kind::publish_text, "/odom", 100);
  on.offer(pair_kind::publish_text, "/arm/pose", 100);
  peer& boss = comes("all", page_at);
  boss.say(R"({"op":"advertise_service","service":"/secret"})");
  boss.say(R"({"op":"advertise_service","service":"/arm/open"})");
  boss.say(R"({"op":"advertise_service","service":"/far/away"})");
  peer& arm = viewer("arm", arm_at);
  EXPECT_EQ(say(arm, subscribe), update(R"({"name":"/arm/pose","publisherIds":["robot"]})", "",
                                        R"({"name":"/arm/open","providerIds":["10.0.0.8:2"]},)" + of_ros));
  boss.say(R"({"op":"subscribe","topic":"/odom"})");
  boss.say(R"({"op":"subscribe","topic":"/hidden"})");
  boss.say(R"({"op":"unadvertise_service","service":"/secret"})");
  pause();
  EXPECT_EQ(heard(arm), "");
  boss.say(R"({"op":"unsubscribe","topic":"/hidden"})");
  boss.say(R"({"op":"subscribe","topic":"/arm/pose"})");
  pause();
  EXPECT_EQ(heard(arm), update("", R"({"name":"/arm/pose","subscriberIds":["10.0.0.8:2"]})", ""));
}

TEST_F(foxglove_graph, takes_the_right_to_ask_what_nodes_do) {
  on.options.access.roles[0].call = {"/arm/*"};
  on.set_access(on.options.access);
  peer& arm = viewer("arm", arm_at);
  const std::string answer = say(arm, subscribe);
  EXPECT_TRUE(has(answer, "has no right to call /rosapi/node_details"));
  pause(2);
  EXPECT_EQ(heard(arm), "");
}

TEST_F(foxglove_graph, is_told_anew_to_a_role_that_may_see_more) {
  on.offer(pair_kind::publish_text, "/odom", 100);
  on.options.access.roles[0].call = {"/rosapi/node_details"};
  on.set_access(on.options.access);
  peer& arm = viewer("arm", arm_at);
  EXPECT_EQ(say(arm, subscribe), update("", "", "")) << "it is told that there is nothing";
  rowe::access_options more = on.options.access;
  more.roles[0].subscribe.emplace_back("/odom");
  on.set_access(more);
  pause();
  EXPECT_EQ(heard(arm), update(R"({"name":"/odom","publisherIds":["robot"]})",
                               R"({"name":"/odom","subscriberIds":[]})", ""));
}

TEST_F(foxglove_graph, is_told_later_to_who_does_not_read_as_it_is_then) {
  peer& one = viewer("all");
  peer& busy = comes("all", page_at);
  graph_view seen;
  (void)one.hear();
  one.tell(subscribe, 2);
  see(one, seen);
  on.net.link_of(one.id()).capacity_bytes = 0;
  for (int i = 0; i < 30; ++i) {
    const std::string name = "/a" + std::to_string(i % 5);
    busy.say(R"({"op":"advertise","topic":")" + name + "\"}");
    busy.say(R"({"op":"subscribe","topic":")" + name + "\"}");
    pause();
    busy.say(R"({"op":"unadvertise","topic":")" + name + "\"}");
    if (i < 28) busy.say(R"({"op":"unsubscribe","topic":")" + name + "\"}");
    if (i == 4) {
      EXPECT_FALSE(one.cut());
    }
    if (i % 7 == 0) { // it takes some
      on.net.link_of(one.id()).capacity_bytes = 40;
      see(one, seen);
    }
  }
  on.net.link_of(one.id()).capacity_bytes = 1U << 20U;
  for (int i = 0; i < 4; ++i) {
    pause();
    see(one, seen);
  }
  EXPECT_EQ(graph_view::held(seen.subscribers),
            (holders{{"/a3", {std::string{page_at}}}, {"/a4", {std::string{page_at}}}}));
  EXPECT_EQ(graph_view::held(seen.publishers), (holders{{"/rowe/stats", {"robot"}}}));
  EXPECT_EQ(seen.publishers.size(), 3U) << "what is gone was removed";
}

// While nobody can be told of what is gone, there is no place for more names.
TEST_F(foxglove_graph, is_told_no_more_to_who_keeps_names_that_are_gone_for_too_long) {
  peer& slow = viewer("all");
  peer& one = viewer("all", "10.0.0.6:6");
  peer& busy = comes("all", page_at);
  graph_view seen;
  (void)say(slow, subscribe);
  one.say(subscribe);
  on.cycles(2);
  see(one, seen);
  on.net.link_of(slow.id()).capacity_bytes = 0;
  const auto names = static_cast<int>(rowe::service::gone_names::count(on.options.limits));
  for (int i = 0; i < names + 3; ++i) {
    const std::string name = "/a" + std::to_string(i);
    busy.say(R"({"op":"advertise","topic":")" + name + "\"}");
    pause();
    busy.say(R"({"op":"unadvertise","topic":")" + name + "\"}");
    see(one, seen);
  }
  pause(2);
  see(one, seen);
  EXPECT_NE(seen.publishers.size(), 1U) << "some is not told yet";
  on.cycles(30, graph_period);
  see(one, seen);
  EXPECT_EQ(seen.publishers, (holders{{"/rowe/stats", {"robot"}}}));
  on.net.link_of(slow.id()).capacity_bytes = 1U << 20U;
  on.cycles(4, graph_period);
  const std::string told = slow.hear_as_one();
  EXPECT_TRUE(has(told, "subscribeConnectionGraph: this client reads changes too slowly"));
  (void)say(slow, unsubscribe);
  EXPECT_TRUE(has(say(slow, subscribe), "/rowe/stats"));
}

struct foxglove_graph_in_small_messages : foxglove_graph {
  foxglove_graph_in_small_messages()
      : foxglove_graph{with_limits(with_viewers(), &limits::connections_max, 40, &limits::message_bytes_max,
                                   640, &limits::small_slot_bytes, 300, &limits::topics_max, 64)} {}
};

TEST_F(foxglove_graph_in_small_messages, is_told_in_several) {
  holders expected{{"/rowe/stats", {"robot"}}};
  for (int i = 0; i < 5; ++i) {
    const std::string at = "10.0.0.9:" + std::to_string(i);
    peer& page = comes("all", at);
    for (int k = 0; k < 3; ++k) {
      const std::string name = "/a_rather_long_name_of_a_topic_" + std::to_string(3 * i + k);
      page.say(R"({"op":"advertise","topic":")" + name + "\"}");
      expected[name] = {at};
    }
    on.cycles(2);
  }
  peer& one = viewer("all");
  graph_view seen;
  one.tell(subscribe, 40);
  see(one, seen);
  EXPECT_GT(seen.updates, 3U);
  EXPECT_EQ(graph_view::held(seen.publishers), expected);
}

TEST_F(foxglove_graph_in_small_messages, says_as_many_of_many_holders_as_fit) {
  for (int i = 0; i < 30; ++i)
    comes("all", "10.0.0.9:" + std::to_string(10000 + i)).say(R"({"op":"subscribe","topic":"/a"})");
  on.cycles(4);
  peer& one = viewer("all");
  graph_view seen;
  one.tell(subscribe, 40);
  see(one, seen);
  const std::size_t told = seen.subscribers["/a"].size();
  EXPECT_GT(told, 8U);
  EXPECT_LT(told, 30U);
  EXPECT_NE(on.count(counter::too_big), 0U);
}

TEST_F(foxglove_graph_in_small_messages, is_told_to_some_peers_in_a_cycle_and_to_the_others_later) {
  for (int i = 0; i < 12; ++i) (void)say(viewer("all", "10.0.0.9:" + std::to_string(i)), subscribe);
  pause();
  for (peer& one : peers) (void)one.hear();
  on.offer(pair_kind::publish_text, "/odom", 100);
  pause(2);
  std::size_t told = 0;
  for (peer& one : peers) told += one.hear().size();
  EXPECT_GE(told, 24U) << "a channel, and an update, for each";
  on.offer(pair_kind::subscribe_text, "/odom", 100);
  std::size_t most = 0;
  told = 0;
  for (int i = 0; i < 300; ++i) {
    on.cycle(1ms);
    std::size_t now = 0;
    for (peer& one : peers) now += one.hear().size();
    most = std::max(most, now);
    told += now;
  }
  EXPECT_EQ(told, 12U);
  EXPECT_EQ(most, rowe::service::graph_messages_per_cycle);
}

struct foxglove_graph_in_short_messages : foxglove_graph {
  foxglove_graph_in_short_messages()
      : foxglove_graph{with_limits(with_viewers(), &limits::message_bytes_max, 150)} {}
};

TEST_F(foxglove_graph_in_short_messages, is_refused) {
  peer& one = viewer("all");
  (void)say(one, subscribe);
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
}

} // namespace
} // namespace core_foxglove_graph_test
