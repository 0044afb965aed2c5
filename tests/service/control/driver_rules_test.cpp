// SPDX-License-Identifier: Apache-2.0
// The rules of one driven topic, by themselves.
#include "service/control/driver_rules.hpp"

#include <gtest/gtest.h>

#include <string>

namespace driver_rules_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::never;
using rowe::rt::time_point;
using rowe::service::driver_rules;
using refusal = driver_rules::refusal;
using verdict = driver_rules::verdict;

constexpr driver_rules::asker anna{.peer = 1ULL << 32, .name = "anna"};
constexpr driver_rules::asker bert{.peer = 2ULL << 32, .name = "bert"};

struct driver_rules_test : testing::Test {
  driver_rules_test() { rules.begin(300ms, now); }

  refusal take(const driver_rules::asker& by, bool over = false) { return rules.take(by, over, now, now); }
  verdict command(const driver_rules::asker& by, time_point sent) {
    const verdict made = rules.judge(by.peer, sent, now).is;
    if (made == verdict::accepted) rules.count(by, sent, now);
    return made;
  }

  time_point now{1000s};
  driver_rules rules;
};

TEST_F(driver_rules_test, a_command_is_in_force_from_when_it_was_sent_until_the_lease_is_over) {
  now += 100ms;
  const auto made = rules.judge(anna.peer, now - 60ms, now);
  EXPECT_EQ(made.is, verdict::accepted);
  EXPECT_EQ(made.until, now + 240ms);
}

TEST_F(driver_rules_test, a_command_gives_control_when_a_loop_has_got_it_and_not_before) {
  now += 100ms;
  ASSERT_EQ(rules.judge(anna.peer, now, now).is, verdict::accepted);
  EXPECT_FALSE(rules.driven());
  const auto turn = rules.turn();
  rules.count(anna, now, now);
  EXPECT_EQ(rules.driver(), "anna"); // nobody drove
  EXPECT_EQ(rules.turn(), turn);     // that of the command
}

TEST_F(driver_rules_test, a_command_as_old_as_the_lease_is_stale) {
  now += 1s;
  EXPECT_EQ(command(anna, now - 300ms), verdict::stale);
  EXPECT_FALSE(rules.driven());
  EXPECT_EQ(command(anna, now - 299ms), verdict::accepted);
}

TEST_F(driver_rules_test, a_command_of_which_nobody_knows_when_it_was_sent_moves_nothing) {
  EXPECT_EQ(command(anna, never), verdict::unproven);
  EXPECT_FALSE(rules.driven());
}

TEST_F(driver_rules_test, only_one_drives) {
  ASSERT_EQ(take(anna), refusal::none);
  now += 10ms;
  EXPECT_EQ(take(bert), refusal::driven);
  EXPECT_EQ(command(bert, now), verdict::refused);
  EXPECT_EQ(command(anna, now), verdict::accepted);
}

TEST_F(driver_rules_test, taking_over_ends_the_turn_of_the_other) {
  ASSERT_EQ(take(anna), refusal::none);
  const auto turn = rules.turn();
  const auto number = rules.number();
  EXPECT_EQ(take(bert, true), refusal::none);
  EXPECT_NE(rules.turn(), turn);
  EXPECT_NE(rules.number(), number);
  now += 1ms;
  EXPECT_EQ(command(anna, now), verdict::refused);
  EXPECT_EQ(command(bert, now), verdict::accepted);
}

TEST_F(driver_rules_test, nobody_takes_over_twice_within_a_second) {
  ASSERT_EQ(take(anna), refusal::none);
  ASSERT_EQ(take(bert, true), refusal::none);
  now += 999ms;
  EXPECT_EQ(take(anna, true), refusal::pause);
  EXPECT_EQ(rules.driver(), "bert");
  now += 1ms;
  EXPECT_EQ(take(anna, true), refusal::none);
}

TEST_F(driver_rules_test, who_may_not_is_refused_before_anything_changes) {
  driver_rules::asker may_not = bert;
  may_not.may_take_over = false;
  ASSERT_EQ(take(anna), refusal::none);
  EXPECT_EQ(take(may_not, true), refusal::role);
  EXPECT_EQ(rules.driver(), "anna");
  rules.release(anna.peer, now);
  EXPECT_EQ(take(may_not), refusal::none);
  rules.release(bert.peer, now);
  may_not.may_drive = false;
  EXPECT_EQ(take(may_not), refusal::role);
  EXPECT_FALSE(rules.driven());
}

TEST_F(driver_rules_test, a_request_needs_a_tick_that_is_not_old) {
  now += 10s;
  EXPECT_EQ(rules.take(anna, false, never, now), refusal::tick);
  EXPECT_EQ(rules.take(anna, false, now - 2s, now), refusal::tick);
  EXPECT_EQ(rules.take(anna, true, now - 1999ms, now), refusal::none);
}

TEST_F(driver_rules_test, control_ends_two_seconds_after_the_last_that_was_sent) {
  ASSERT_EQ(rules.take(anna, false, now - 500ms, now), refusal::none);
  const auto turn = rules.turn();
  EXPECT_EQ(rules.next_update(), now + 1500ms);
  now += 1499ms;
  rules.update(now);
  EXPECT_TRUE(rules.driven_by(anna.peer));
  now += 1ms;
  rules.update(now);
  EXPECT_FALSE(rules.driven());
  EXPECT_NE(rules.turn(), turn);
  EXPECT_EQ(rules.next_update(), never);
}

TEST_F(driver_rules_test, commands_and_repeated_requests_keep_control) {
  ASSERT_EQ(take(anna), refusal::none);
  for (int i = 0; i < 10; ++i) {
    now += 1900ms;
    ASSERT_EQ(i % 2 == 0 ? command(anna, now) == verdict::accepted : take(anna) == refusal::none, true);
  }
  EXPECT_EQ(rules.number(), 1U);
}

TEST_F(driver_rules_test, a_long_lease_keeps_control_as_long) {
  rules.set_lease(5s);
  EXPECT_EQ(rules.kept_for(), 5s);
  ASSERT_EQ(command(anna, now + 1ms), verdict::accepted);
  now += 4900ms;
  rules.update(now);
  EXPECT_TRUE(rules.driven());
}

TEST_F(driver_rules_test, only_the_driver_releases) {
  ASSERT_EQ(take(anna), refusal::none);
  rules.release(bert.peer, now);
  EXPECT_TRUE(rules.driven());
  rules.release(anna.peer, now);
  EXPECT_FALSE(rules.driven());
  rules.release(0, now); // nobody is nobody's
  EXPECT_FALSE(rules.driven_by(0));
}

TEST_F(driver_rules_test, what_was_sent_before_a_reset_does_not_count_after_it) {
  now += 1s;
  ASSERT_EQ(command(anna, now), verdict::accepted);
  const auto turn = rules.turn();
  now += 20ms;
  rules.void_commands(now);
  EXPECT_NE(rules.turn(), turn);
  EXPECT_TRUE(rules.driven_by(anna.peer)); // control stays
  EXPECT_EQ(command(anna, now), verdict::stale);
  now += 1ms;
  EXPECT_EQ(command(anna, now), verdict::accepted);
}

TEST_F(driver_rules_test, a_driver_keeps_no_control_that_was_kept_for_the_one_before) {
  now += 1s;
  ASSERT_EQ(take(anna), refusal::none);
  rules.release(anna.peer, now);
  ASSERT_EQ(command(bert, now - 200ms), verdict::accepted);
  now += 1800ms;
  rules.update(now);
  EXPECT_FALSE(rules.driven());
}

TEST_F(driver_rules_test, a_name_is_cut_between_two_characters) {
  const std::string name(63, 'a');
  const std::string long_name = name + "\u00e9";
  ASSERT_EQ(take({.peer = 5, .name = long_name}), refusal::none);
  EXPECT_EQ(rules.driver(), name);
  const auto version = rules.version();
  ASSERT_EQ(take({.peer = 5, .name = "other"}), refusal::none);
  EXPECT_EQ(rules.driver(), "other");
  EXPECT_NE(rules.version(), version);
}

TEST_F(driver_rules_test, each_refusal_has_a_name_of_its_own) {
  EXPECT_EQ(driver_rules::name_of(refusal::none), "");
  EXPECT_EQ(driver_rules::name_of(refusal::pause), "pause");
  EXPECT_EQ(driver_rules::name_of(refusal::driven), "driven");
}

} // namespace
} // namespace driver_rules_test
