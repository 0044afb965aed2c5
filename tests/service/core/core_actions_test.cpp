// SPDX-License-Identifier: Apache-2.0
// Actions through the core: from who sends a goal to the peer that provides the action and back, and every
// way a goal ends.
#include "core_fixtures.hpp"

namespace core_actions_test {
namespace {

using namespace harness;

struct core_actions : core_test {
  core_actions() : core_test{bounded()} {
    provider.tell(R"({"op":"advertise_action","type":"a/Dock","action":"/dock"})");
  }
  static rowe::endpoint_options bounded() {
    auto options = small_options();
    options.limits.calls_max = 24; // one peer may have four
    options.call_timeout = 2s;
    options.relay = true;
    return options;
  }
  void send_goal(peer& from, const std::string& id, const std::string& more = "") {
    from.tell(
        R"({"op":"send_action_goal","id":")" + id + R"(","action":"/dock","args":{"at":1})" + more + "}", 2);
  }
  // The ids of the goals that the provider was given.
  std::vector<std::string> given(std::string_view op = "send_action_goal") {
    std::vector<std::string> ids;
    for (const std::string& text : provider.hear()) {
      const std::string begins = R"({"op":")" + std::string{op} + R"(","id":")";
      if (!text.starts_with(begins)) continue;
      ids.push_back(text.substr(begins.size(), text.find('"', begins.size()) - begins.size()));
    }
    return ids;
  }
  void provider_says(const std::string& op, const std::string& id, const std::string& members) {
    provider.tell(R"({"op":")" + op + R"(","id":")" + id + R"(","action":"/dock",)" + members + "}", 2);
  }
  peer provider{on};
  peer page{on};
};

TEST_F(core_actions, hands_a_goal_on_with_its_feedback_and_its_result) {
  send_goal(page, "g", R"(,"feedback":true)");
  const std::string asked = only(provider.hear());
  EXPECT_TRUE(asked.ends_with(R"("action":"/dock","action_type":"a/Dock","feedback":true,"args":{"at":1}})"))
      << asked;
  send_goal(page, "h", R"(,"feedback":true)");
  const std::string ids = only(given());
  provider_says("action_feedback", ids, R"("values":{"far":9})");
  EXPECT_EQ(page.hear(), texts{R"({"op":"action_feedback","id":"h","action":"/dock","values":{"far":9}})"});
  provider_says("action_result", ids, R"("values":{"far":0},"status":4,"result":true)");
  EXPECT_EQ(page.hear(), texts{R"({"op":"action_result","id":"h","action":"/dock","status":4,"result":true,)"
                               R"("values":{"far":0}})"});
  provider_says("action_result", ids, R"("values":{},"status":4,"result":true)");
  EXPECT_TRUE(page.hear().empty());
  EXPECT_EQ(on.count(counter::replies_late), 1U);
}

TEST_F(core_actions, hands_no_feedback_on_that_was_not_asked_for) {
  send_goal(page, "g");
  provider_says("action_feedback", given().at(0), R"("values":{})");
  EXPECT_TRUE(page.hear().empty());
}

TEST_F(core_actions, says_how_a_goal_failed) {
  send_goal(page, "g");
  provider_says("action_result", given().at(0), R"("status":6,"result":false)");
  const std::string heard = only(page.hear());
  EXPECT_TRUE(heard.starts_with(
      R"({"op":"action_result","id":"g","action":"/dock","status":6,"result":false,"values":")"))
      << heard;
}

TEST_F(core_actions, tells_who_sends_a_goal_to_nobody) {
  EXPECT_EQ(page.ask(R"({"op":"send_action_goal","id":"g","action":"/none"})"),
            texts{R"({"op":"action_result","id":"g","action":"/none","status":0,"result":false,)"
                  R"("values":"Action /none does not exist"})"});
  EXPECT_EQ(on.count(counter::calls_refused), 1U);
}

TEST_F(core_actions, keeps_actions_and_services_apart) {
  page.tell(R"({"op":"call_service","id":"c","service":"/dock"})");
  EXPECT_TRUE(given("call_service").empty());
  (void)page.hear();
  page.say(R"({"op":"call_service","id":"l","service":"/rosapi/services"})");
  page.say(R"({"op":"call_service","id":"a","service":"/rosapi/action_servers"})");
  const texts lists = page.hear_after(2);
  ASSERT_EQ(lists.size(), 2U);
  EXPECT_FALSE(has(lists[0], "/dock"));
  EXPECT_TRUE(has(lists[1], R"("action_servers":["/dock"])"));
}

TEST_F(core_actions, takes_a_goal_back_once_and_ends_it_in_the_time_of_a_call) {
  send_goal(page, "g");
  const auto ids = given();
  for (int s = 0; s < 60; ++s) { // a goal has no end of its own
    on.cycles(1, 1s);
    EXPECT_TRUE(page.hear().empty());
    EXPECT_TRUE(given("cancel_action_goal").empty());
  }
  const peer comes{on}; // which does not change the goal's id
  on.cycle();
  for (int i = 0; i < 2; ++i) page.tell(R"({"op":"cancel_action_goal","id":"g","action":"/dock"})", 2);
  EXPECT_EQ(given("cancel_action_goal"), ids);
  on.cycles(3, 1s);
  const std::string heard = only(page.hear());
  EXPECT_TRUE(has(heard, "in time"));
  EXPECT_EQ(on.count(counter::calls_timed_out), 1U);
}

TEST_F(core_actions, takes_back_only_what_the_same_peer_has_sent) {
  send_goal(page, "g");
  const std::string id = given().at(0);
  peer other{on};
  on.cycle();
  for (const std::string& meant : {std::string{"g"}, id})
    other.tell(R"({"op":"cancel_action_goal","id":")" + meant + R"(","action":"/dock"})");
  EXPECT_EQ(other.hear().size(), 2U); // refused
  other.say(R"({"op":"action_result","status":4,"action":"/dock","id":")" + id + R"("})");
  other.say(R"({"op":"action_feedback","values":{},"action":"/dock","id":")" + id + R"("})");
  on.cycles(2);
  EXPECT_EQ(on.count(counter::replies_foreign), 2U);
  provider_says("service_response", id, R"("service":"/dock","values":{})");
  EXPECT_EQ(on.count(counter::replies_foreign), 3U);
  EXPECT_TRUE(page.hear().empty());
  EXPECT_TRUE(given("cancel_action_goal").empty());
}

TEST_F(core_actions, ends_a_goal_at_its_own_timeout_and_tells_the_provider) {
  send_goal(page, "g", R"(,"timeout":5)");
  const auto ids = given();
  on.cycles(7, 1s);
  EXPECT_EQ(page.hear().size(), 1U);
  EXPECT_EQ(given("cancel_action_goal"), ids);
}

TEST_F(core_actions, takes_the_goals_of_a_peer_that_leaves_back) {
  peer leaves{on};
  send_goal(leaves, "g");
  const auto ids = given();
  ASSERT_EQ(ids.size(), 1U);
  leaves.leave();
  on.cycles(2);
  EXPECT_EQ(given("cancel_action_goal"), ids);
  EXPECT_TRUE(on.core.check());
}

TEST_F(core_actions, ends_the_goals_of_a_provider_that_leaves) {
  send_goal(page, "g");
  provider.leave();
  const std::string heard = only(page.hear_after(2));
  EXPECT_TRUE(heard.starts_with(R"({"op":"action_result","id":"g",)")) << heard;
  EXPECT_EQ(on.count(counter::calls_lost), 1U);
}

TEST_F(core_actions, counts_goals_as_calls_of_their_peer) {
  for (const char* id : {"1", "2", "3", "4", "5"}) send_goal(page, id);
  EXPECT_EQ(given().size(), 4U);
  EXPECT_EQ(on.count(counter::calls_in), 5U);
  EXPECT_EQ(on.count(counter::calls_out), 4U);
  const std::string heard = only(page.hear());
  EXPECT_TRUE(has(heard, "too many calls are in flight"));
}

TEST_F(core_actions, loses_feedback_that_nobody_reads_and_counts_it) {
  send_goal(page, "g", R"(,"feedback":true)");
  const std::string id = given().at(0);
  for (int i = 0; i < 40; ++i)
    provider.say(R"({"op":"action_feedback","values":{},"action":"/dock","id":")" + id + R"("})");
  provider_says("action_result", id, R"("values":{},"status":4,"result":true)");
  const texts heard = page.hear_after(60);
  ASSERT_FALSE(heard.empty());
  EXPECT_TRUE(heard.back().starts_with(R"({"op":"action_result")")) << heard.back();
  EXPECT_EQ(heard.size() - 1 + on.count(counter::outbox_full), 40U);
}

} // namespace
} // namespace core_actions_test
