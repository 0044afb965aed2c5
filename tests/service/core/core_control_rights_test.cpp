// SPDX-License-Identifier: Apache-2.0
// Who may drive and take over, where peers have roles.
#include "access_fixture.hpp"

#include <rowe/subscriber.hpp>

namespace core_control_rights_test {
namespace {

using namespace access_fixture;

struct control_rights : access {
  static rowe::endpoint_options options() {
    rowe::endpoint_options made = with_roles();
    made.access.roles.push_back(
        {.name = "guest", .subscribe = {"**"}, .publish = {"/cmd_vel"}, .call = {"/rowe/control"}});
    made.access.identities.push_back({"guest", "guest", rowe::hash_token(token_of("guest"))});
    return made;
  }
  control_rights() : access{options()} {
    (void)on.offer_now(rowe::detail::subscribe_request<pose>("/cmd_vel", {.lease = 300ms}));
  }

  std::string control(peer& by, const std::string& action) {
    const auto call = [&](const std::string& args) {
      const std::string answer =
          answer_to(by, R"({"op":"call_service","service":"/rowe/control","args":{)" + args + "}}");
      return member(answer, "values");
    };
    const std::string tick = member(call(""), "tick");
    return call(R"("action":")" + action + R"(","name":"stick","tick":)" + tick);
  }
};

TEST_F(control_rights, a_driver_is_shown_by_its_identity) {
  peer& anna = comes("driver");
  EXPECT_EQ(member(control(anna, "take"), "driver"), "\"driver (stick)\"");
}

TEST_F(control_rights, taking_over_may_be_forbidden_by_role) {
  peer& anna = comes("driver");
  peer& guest = comes("guest");
  ASSERT_EQ(member(control(anna, "take"), "refused"), "null");
  const std::string answer = control(guest, "take_over");
  EXPECT_EQ(member(answer, "refused"), R"("role")");
  EXPECT_EQ(member(answer, "right"), R"("take_over")");
  EXPECT_EQ(member(answer, "driver"), "\"driver (stick)\"");
  EXPECT_GE(on.count(rowe::service::counter::denied), 1U);
  (void)control(anna, "release");
  EXPECT_EQ(member(control(guest, "take"), "refused"), "null");
  EXPECT_EQ(member(control(anna, "take_over"), "refused"), "null");
}

TEST_F(control_rights, an_observer_does_not_drive) {
  peer& wall = comes("observer");
  const std::string answer =
      answer_to(wall, R"({"op":"call_service","service":"/rowe/control","args":{"action":"take"}})");
  EXPECT_TRUE(has(answer, R"("result":false)")) << answer;
  EXPECT_TRUE(has(answer, "no right to call"));
}

TEST_F(control_rights, who_loses_the_right_drives_no_more) {
  peer& anna = comes("driver");
  ASSERT_EQ(member(control(anna, "take"), "refused"), "null");
  rowe::access_options less = options().access;
  less.roles.push_back({.name = "driver", .subscribe = {"**"}, .call = {"**"}});
  on.set_access(less);
  on.cycles(2);
  peer& guest = comes("guest");
  EXPECT_EQ(member(control(guest, "take"), "refused"), "null");
}

} // namespace
} // namespace core_control_rights_test
