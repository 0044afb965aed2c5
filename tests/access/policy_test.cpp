// SPDX-License-Identifier: Apache-2.0
#include "access/policy.hpp"

#include <gtest/gtest.h>

namespace policy_test {
namespace {

using rowe::access_options;
using rowe::hash_token;
using rowe::access::nobody;
using rowe::access::policy;
using rowe::access::right;

constexpr std::string_view alice_token = "alice-has-a-token-of-her-own";
constexpr std::string_view screen_token = "the-screen-in-the-hall-has-one";

access_options options() {
  return {.roles = {{.name = "arm", .publish = {"/arm/*"}, .call = {"/arm/**", "/rosapi/topics"}}},
          .identities = {{.name = "alice", .role = "supervisor", .token_sha256 = hash_token(alice_token)},
                         {.name = "arm-1",
                          .role = "arm",
                          .token_sha256 = hash_token("the-arm-is-number-one")},
                         {.name = "screen",
                          .role = "observer",
                          .token_sha256 = hash_token(screen_token),
                          .token_in_url = true}}};
}

TEST(policy, without_identities_is_not_in_use) {
  EXPECT_FALSE(policy{}.in_use());
  EXPECT_FALSE(policy{access_options{}}.in_use());
  EXPECT_TRUE(policy{options()}.in_use());
}

TEST(policy, knows_whose_a_token_is) {
  const policy of{options()};
  const auto alice = of.find(alice_token, false);
  ASSERT_TRUE(alice);
  EXPECT_EQ(of.identity_name(alice->identity), "alice");
  EXPECT_EQ(of.role_name(alice->role), "supervisor");
  EXPECT_FALSE(of.find("alice-has-a-token-of-her-owm", false));
  EXPECT_FALSE(of.find("", false));
  EXPECT_FALSE(of.find(std::string(1000, 'x'), false));
}

TEST(policy, takes_a_token_from_the_url_only_where_that_is_said) {
  const policy of{options()};
  EXPECT_FALSE(of.find(alice_token, true));
  EXPECT_TRUE(of.find(screen_token, true));
  EXPECT_TRUE(of.find(screen_token, false));
}

TEST(policy, gives_each_of_its_own_roles_its_rights) {
  struct row {
    std::string_view token;
    bool subscribe, publish, advertise, call, rosapi, provide, reset, guard;
  };
  access_options all;
  for (const char* const name : {"observer", "driver", "supervisor", "peer"})
    all.identities.push_back({name, name, hash_token(std::string{name} + "-is-my-token")});
  const policy of{all};
  for (const row& expected :
       {row{"observer-is-my-token", true, false, false, false, true, false, false, false},
        row{"driver-is-my-token", true, true, true, true, true, false, false, false},
        row{"supervisor-is-my-token", true, true, true, true, true, false, true, true},
        row{"peer-is-my-token", true, true, true, true, true, true, false, false}}) {
    const auto who = of.find(expected.token, false);
    ASSERT_TRUE(who);
    const auto may = [&](right what, std::string_view name = {}) { return of.allows(who->role, what, name); };
    EXPECT_EQ(may(right::subscribe, "/a/b"), expected.subscribe) << expected.token;
    EXPECT_EQ(may(right::publish, "/a/b"), expected.publish) << expected.token;
    EXPECT_EQ(may(right::advertise, "/a/b"), expected.advertise) << expected.token;
    EXPECT_EQ(may(right::call, "/a/b"), expected.call) << expected.token;
    EXPECT_EQ(may(right::call, "/rosapi/topics"), expected.rosapi) << expected.token;
    EXPECT_EQ(may(right::provide, "/a/b"), expected.provide) << expected.token;
    EXPECT_EQ(may(right::reset), expected.reset) << expected.token;
    EXPECT_EQ(may(right::guard), expected.guard) << expected.token;
    EXPECT_EQ(may(right::publish, ""), expected.publish) << expected.token; // plain messages
  }
}

TEST(policy, gives_a_role_of_the_users_what_its_patterns_say) {
  const policy of{options()};
  const auto arm = of.find("the-arm-is-number-one", false);
  ASSERT_TRUE(arm);
  EXPECT_TRUE(of.allows(arm->role, right::publish, "arm/joints"));
  EXPECT_FALSE(of.allows(arm->role, right::publish, "/arm/left/joints"));
  EXPECT_FALSE(of.allows(arm->role, right::publish, "/cmd_vel"));
  EXPECT_FALSE(of.allows(arm->role, right::publish, ""));
  EXPECT_TRUE(of.allows(arm->role, right::call, "/arm/left/open"));
  EXPECT_TRUE(of.allows(arm->role, right::call, "/rosapi/topics"));
  EXPECT_FALSE(of.allows(arm->role, right::call, "/rosapi/services"));
  EXPECT_FALSE(of.allows(arm->role, right::subscribe, "/odom"));
  EXPECT_FALSE(of.allows(arm->role, right::reset));
  access_options stars = options();
  stars.roles[0].publish = {"*", "/*"};
  stars.roles[0].call = {"/**"};
  const policy starred{stars};
  EXPECT_TRUE(starred.allows(arm->role, right::publish, "/x"));
  EXPECT_FALSE(starred.allows(arm->role, right::publish, "")) << "plain messages have no name";
  EXPECT_TRUE(starred.allows(arm->role, right::call, "")) << "it is everything";
}

TEST(policy, lets_a_role_replace_one_of_its_own) {
  access_options chosen = options();
  chosen.roles.push_back({.name = "supervisor", .subscribe = {"/odom"}, .guard = true});
  const policy of{chosen};
  const auto alice = of.find(alice_token, false);
  ASSERT_TRUE(alice);
  EXPECT_TRUE(of.allows(alice->role, right::guard));
  EXPECT_FALSE(of.allows(alice->role, right::reset));
  EXPECT_FALSE(of.allows(alice->role, right::publish, "/odom"));
}

TEST(policy, allows_nobody_anything) {
  const policy of{options()};
  for (int what = 0; what <= static_cast<int>(right::guard); ++what)
    EXPECT_FALSE(of.allows(nobody, static_cast<right>(what), "/odom"));
  EXPECT_EQ(of.local().role, nobody);
  access_options local = options();
  local.local_role = "driver";
  EXPECT_TRUE(policy{local}.allows(policy{local}.local().role, right::publish, "/cmd_vel"));
}

} // namespace
} // namespace policy_test
