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
  return {
      .roles = {{.name = "arm", .publish = {"/arm/*"}, .call = {"/arm/**", "/rosapi/topics"}}},
      .identities = {{.name = "alice", .role = "supervisor", .token_sha256 = hash_token(alice_token)},
                     {.name = "arm-1", .role = "arm", .token_sha256 = hash_token("the-arm-is-number-one")},
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

TEST(policy, knows_whose_a_certificate_is) {
  access_options with = options();
  with.identities[0].certificate = "Alice";
  with.identities.push_back({.name = "bob", .role = "driver", .certificate = "Bob"});
  const policy of{with};
  const auto alice = of.find_certificate("Alice");
  ASSERT_TRUE(alice);
  EXPECT_EQ(alice, of.find(alice_token, false)) << "one identity with two proofs";
  const auto bob = of.find_certificate("Bob");
  ASSERT_TRUE(bob);
  EXPECT_EQ(of.identity_name(bob->identity), "bob");
  EXPECT_EQ(of.role_name(bob->role), "driver");
  for (const std::string_view name : {"", "bob", "Bob ", "alice", "Alic", "Alice2"})
    EXPECT_FALSE(of.find_certificate(name)) << name;
  EXPECT_FALSE(policy{options()}.find_certificate("")) << "most identities have none";
}

// Nobody can have the empty token, or one whose hash is nothing.
TEST(policy, knows_no_token_of_who_has_a_certificate_alone) {
  const policy of{access_options{.identities = {{.name = "bob", .role = "driver", .certificate = "Bob"}}}};
  EXPECT_TRUE(of.in_use());
  for (const std::string_view token : {"", "Bob", "Bob-and-some-more-letters", "0000000000000000"})
    EXPECT_FALSE(of.find(token, false)) << token;
}

TEST(policy, gives_each_of_its_own_roles_its_rights) {
  struct row {
    std::string_view token;
    bool subscribe, publish, advertise, call, rosapi, provide, set, reset, guard;
  };
  access_options all;
  for (const char* const name : {"observer", "driver", "supervisor", "peer"})
    all.identities.push_back({name, name, hash_token(std::string{name} + "-is-my-token")});
  const policy of{all};
  for (const row& expected :
       {row{"observer-is-my-token", true, false, false, false, true, false, false, false, false},
        row{"driver-is-my-token", true, true, true, true, true, false, false, false, false},
        row{"supervisor-is-my-token", true, true, true, true, true, false, true, true, true},
        row{"peer-is-my-token", true, true, true, true, true, true, false, false, false}}) {
    const auto who = of.find(expected.token, false);
    ASSERT_TRUE(who);
    const auto may = [&](right what, std::string_view name = {}) { return of.allows(who->role, what, name); };
    EXPECT_EQ(may(right::subscribe, "/a/b"), expected.subscribe) << expected.token;
    EXPECT_EQ(may(right::publish, "/a/b"), expected.publish) << expected.token;
    EXPECT_EQ(may(right::advertise, "/a/b"), expected.advertise) << expected.token;
    EXPECT_EQ(may(right::call, "/a/b"), expected.call) << expected.token;
    EXPECT_EQ(may(right::call, "/rosapi/topics"), expected.rosapi) << expected.token;
    EXPECT_EQ(may(right::call, "/rowe/stats"), expected.rosapi) << expected.token; // as its topic
    EXPECT_EQ(may(right::provide, "/a/b"), expected.provide) << expected.token;
    EXPECT_EQ(may(right::set, "/a/b"), expected.set) << expected.token;
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

TEST(policy, says_what_becomes_of_those_whom_the_one_before_let_in) {
  using enum rowe::access::successor::fate;
  const policy before{options()};
  const auto fate_of = [&](std::string_view token, const access_options& chosen) {
    return policy{chosen, before}.succeed(*before.find(token, false)).what;
  };
  EXPECT_EQ(fate_of(alice_token, options()), kept);
  access_options chosen = options();
  chosen.identities.erase(chosen.identities.begin());
  EXPECT_EQ(fate_of(alice_token, chosen), revoked);
  EXPECT_EQ(fate_of(screen_token, chosen), kept); // by another number
  chosen = options();
  chosen.identities[0].token_sha256 = hash_token(screen_token);
  EXPECT_EQ(fate_of(alice_token, chosen), revoked);
  chosen = options();
  chosen.identities[0].role = "peer"; // which may provide, but not reset
  EXPECT_EQ(fate_of(alice_token, chosen), changed);
  chosen = options();
  chosen.identities[2].role = "driver";
  EXPECT_EQ(fate_of(screen_token, chosen), grown);
  chosen.identities[2].token_in_url = false;
  EXPECT_EQ(fate_of(screen_token, chosen), changed);

  constexpr std::string_view arm_token = "the-arm-is-number-one";
  const auto fate_of_arm = [&](auto&& change) {
    access_options to = options();
    change(to.roles[0]);
    return fate_of(arm_token, to);
  };
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm.guard = true; }), grown);
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm.subscribe = {"/x"}; }), grown);
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm.publish = {"**"}; }), grown);
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm.call = {"/rosapi/topics", "/arm/**"}; }), kept);
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm.call = {"/arm/**"}; }), changed);
  EXPECT_EQ(fate_of_arm([](auto& arm) { arm = {.name = "arm", .guard = true}; }), changed);
}

// Whoever came in by something must still be able to.
TEST(policy, takes_an_identity_that_has_lost_a_proof_for_another_one) {
  using enum rowe::access::successor::fate;
  const auto both = [](std::string_view token, std::string_view certificate) {
    access_options made = options();
    made.identities[0].token_sha256 = token.empty() ? "" : hash_token(token);
    made.identities[0].certificate = certificate;
    return made;
  };
  const auto fate = [](const access_options& from, const access_options& to) {
    const policy before{from};
    return policy{to, before}.succeed({.role = 0, .identity = 0}).what;
  };
  EXPECT_EQ(fate(both(alice_token, "Alice"), both(alice_token, "Alice")), kept);
  EXPECT_EQ(fate(both(alice_token, ""), both(alice_token, "Alice")), kept) << "one more takes nothing away";
  EXPECT_EQ(fate(both("", "Alice"), both(alice_token, "Alice")), kept);
  EXPECT_EQ(fate(both(alice_token, "Alice"), both(alice_token, "")), revoked);
  EXPECT_EQ(fate(both(alice_token, "Alice"), both("", "Alice")), revoked);
  EXPECT_EQ(fate(both(alice_token, "Alice"), both(alice_token, "Alicia")), revoked);
  EXPECT_EQ(fate(both("", "Alice"), both(alice_token, "")), revoked);
}

TEST(policy, counts_its_versions_and_says_which_let_somebody_in) {
  const policy first{options()};
  const policy second{options(), first};
  const policy third{options(), second};
  EXPECT_EQ(first.version(), 0U);
  EXPECT_EQ(third.version(), 2U);
  EXPECT_EQ(second.find(alice_token, false)->version, 1U);
  EXPECT_EQ(third.succeed(*second.find(alice_token, false)).who.version, 2U);
  EXPECT_EQ(third.local().version, 2U);
  EXPECT_EQ(third.anonymous().version, 2U);
}

TEST(policy, lets_nobody_stay_who_came_without_a_token_that_is_wanted_now) {
  using enum rowe::access::successor::fate;
  const policy open;
  EXPECT_EQ(policy(options(), open).succeed(open.anonymous()).what, revoked);
  EXPECT_EQ(policy(access_options{}, open).succeed(open.anonymous()).what, kept);
  access_options with_local = options();
  with_local.local_role = "driver";
  const policy before{with_local};
  EXPECT_EQ(policy(with_local, before).succeed(before.local()).what, kept);
  EXPECT_EQ(policy(options(), before).succeed(before.local()).what, revoked);
  with_local.local_role = "observer";
  EXPECT_EQ(policy(with_local, before).succeed(before.local()).what, changed);
}

TEST(policy, names_what_is_everything_or_written_out) {
  access_options chosen = options();
  chosen.roles[0].subscribe = {"/rowe/*", "**/stats"};
  const auto names = [&] {
    const policy of{chosen};
    return of.names(of.find("the-arm-is-number-one", false)->role, right::subscribe, "/rowe/stats");
  };
  EXPECT_FALSE(names());
  chosen.roles[0].subscribe.emplace_back("rowe/stats");
  EXPECT_TRUE(names());
  chosen.roles[0].subscribe = {"**"};
  EXPECT_TRUE(names());
}

} // namespace
} // namespace policy_test
