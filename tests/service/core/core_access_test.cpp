// SPDX-License-Identifier: Apache-2.0
// Roles: who is let in, and what becomes of what each peer asks for. core_rights_table_test.cpp has who may
// do what.
#include "access_fixture.hpp"

namespace core_access_test {
namespace {

using namespace access_fixture;

TEST_F(access, lets_nobody_in_without_a_token_that_is_known) {
  EXPECT_FALSE(is_in(comes("")));
  peers.clear();
  EXPECT_FALSE(is_in(comes("", here))); // an address is no role
  peers.clear();
  EXPECT_FALSE(is_in(comes("mallory")));
  peers.clear();
  EXPECT_FALSE(is_in(comes("", far, rowe::service::stop_path)));
  peers.clear();
  EXPECT_TRUE(is_in(comes("observer")));
}

struct local_access : access {
  local_access()
      : access{with_roles([](rowe::access_options& to) {
          to.local_role = "supervisor";
          to.anonymous_may_stop = true;
        })} {}
};

TEST_F(local_access, gives_peers_of_this_machine_the_role_that_is_chosen_for_them) {
  peer& p = comes("", here);
  ASSERT_TRUE(is_in(p));
  EXPECT_EQ(answer_to(p, R"({"op":"publish","topic":"/x","msg":{}})"), "");
  EXPECT_EQ(on.count(counter::denied), 0U);
}

TEST_F(local_access, lets_anybody_come_to_stop_and_to_do_nothing_else) {
  EXPECT_TRUE(is_in(comes("", far, rowe::service::stop_path)));
  peer& p = peers.back();
  EXPECT_TRUE(has(answer_to(p, R"({"op":"subscribe","topic":"/odom"})"), "may only stop"));
}

TEST_F(access, tells_who_was_denied_what) {
  peer& observer = comes("observer");
  (void)events();
  const std::string told = answer_to(observer, R"({"op":"publish","id":"7","topic":"/cmd_vel","msg":{}})");
  const std::string why = "observer, role observer, has no right to publish /cmd_vel";
  EXPECT_TRUE(has(told, why));
  EXPECT_TRUE(has(told, R"("id":"7")"));
  EXPECT_EQ(events(), why + "\n");
}

TEST_F(access, says_nothing_more_to_who_takes_back_what_was_denied) {
  peer& observer = comes("observer");
  EXPECT_TRUE(has(answer_to(observer, R"({"op":"advertise","topic":"/cmd_vel"})"), "no right to advertise"));
  const auto before = on.count(counter::refused_requests);
  (void)events();
  EXPECT_EQ(answer_to(observer, R"({"op":"unadvertise","topic":"/cmd_vel"})"), "");
  EXPECT_EQ(events(), "");
  EXPECT_EQ(on.count(counter::refused_requests), before + 1);
  peer& driver = comes("driver");
  EXPECT_TRUE(has(answer_to(driver, R"({"op":"unadvertise","topic":"/cmd_vel"})"), "does not advertise"));
}

TEST_F(access, leaves_room_for_other_events_however_much_is_denied) {
  for (int i = 0; i < 2000; ++i) { // more peers come, are denied and go than there are places for events
    peer& one = comes("observer");
    (void)answer_to(one, R"({"op":"publish","topic":"/cmd_vel","msg":{}})");
    one.leave();
    on.cycle();
    peers.clear();
  }
  EXPECT_GT(on.count(counter::events_lost), 0U);
  const auto lost = on.count(counter::events_lost);
  rowe::event own;
  own.what_kind = rowe::event::kind::warning;
  on.shared.post(own);
  EXPECT_EQ(on.count(counter::events_lost), lost);
}

struct stop_access : local_access {
  stoppable_loop loop{on};
};

TEST_F(stop_access, lets_somebody_whose_token_is_not_known_any_more_stop) {
  EXPECT_TRUE(is_in(comes("mallory", far, rowe::service::stop_path)));
}

TEST(access_of_a_client, does_not_ask_its_server_for_a_role) {
  auto options = with_roles();
  core_harness on{options, rowe::service::side::client};
  on.cycle();
  peer server{on, rowe::service::side::client, "10.0.0.1:9090"};
  on.cycle();
  server.tell(R"({"op":"publish","topic":"/odom","msg":{}})", 2);
  EXPECT_EQ(on.count(counter::denied), 0U);
}

} // namespace
} // namespace core_access_test
