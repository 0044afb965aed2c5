// SPDX-License-Identifier: Apache-2.0
#include "tools/demo_robot/robot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace rowe::tools {
namespace robot_test {
namespace {

constexpr int steps_a_second = 1000;
static_assert(robot::period * steps_a_second == 1);

double distance(const planar_pose& a, const planar_pose& b) { return std::hypot(a.x - b.x, a.y - b.y); }

TEST(robot, begins_at_rest_on_its_path) {
  const robot moving;
  EXPECT_EQ(distance(moving.pose(), moving.reference()), 0);
  EXPECT_EQ(moving.twist().forward, 0);
  EXPECT_EQ(moving.twist().turn, 0);
}

TEST(robot, keeps_to_the_figure_of_eight_for_an_hour) {
  robot moving;
  for (int i = 0; i < 5 * steps_a_second; ++i) moving.step(); // it begins slower than its reference
  double worst = 0;
  for (int i = 0; i < 3600 * steps_a_second; ++i) {
    moving.step();
    worst = std::max(worst, distance(moving.pose(), moving.reference()));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(robot, turns_both_ways_and_crosses_the_whole_figure) {
  robot moving;
  double left = 0, right = 0, farthest = 0;
  for (int i = 0; i < 2 * static_cast<int>(robot::lap) * steps_a_second; ++i) {
    moving.step();
    left = std::max(left, moving.twist().turn);
    right = std::min(right, moving.twist().turn);
    farthest = std::max(farthest, std::abs(moving.pose().x));
  }
  EXPECT_GT(left, 0.3);
  EXPECT_LT(right, -0.3);
  EXPECT_NEAR(farthest, robot::half_length, 0.05);
}

TEST(robot, respects_the_limits_of_its_wheels) {
  robot moving;
  wheel_speeds before = moving.wheels();
  for (int i = 0; i < 60 * steps_a_second; ++i) {
    moving.step();
    const wheel_speeds now = moving.wheels();
    constexpr double change_max = robot::wheel_acceleration_max * robot::period * (1 + 1e-9);
    ASSERT_LE(std::abs(now.left), robot::wheel_speed_max);
    ASSERT_LE(std::abs(now.right), robot::wheel_speed_max);
    ASSERT_LE(std::abs(now.left - before.left), change_max) << "step " << i;
    ASSERT_LE(std::abs(now.right - before.right), change_max) << "step " << i;
    before = now;
  }
}

TEST(robot, brakes_within_its_limits_along_its_curve_and_stands) {
  for (const int driven : {3, 7, 11, 16, 22}) {
    robot moving;
    for (int i = 0; i < driven * steps_a_second; ++i) moving.step();
    const double speed = moving.twist().forward;
    const planar_pose begin = moving.pose();
    wheel_speeds before = moving.wheels();
    for (int i = 0; i < 2 * steps_a_second; ++i) {
      moving.brake();
      const wheel_speeds now = moving.wheels();
      constexpr double change_max = robot::wheel_acceleration_max * robot::period * (1 + 1e-9);
      ASSERT_LE(std::abs(now.left - before.left), change_max) << "step " << i;
      ASSERT_LE(std::abs(now.right - before.right), change_max) << "step " << i;
      before = now;
    }
    EXPECT_EQ(moving.twist().forward, 0);
    EXPECT_EQ(moving.twist().turn, 0);
    // Half the square of its speed by what it may brake with, and what the wheels' lag adds.
    const double rolled = speed * speed / 2 / robot::wheel_acceleration_max + speed * robot::wheel_lag;
    EXPECT_NEAR(distance(begin, moving.pose()), rolled, 0.02);
    EXPECT_LT(distance(moving.pose(), moving.reference()), 0.1);
    const planar_pose stands = moving.pose();
    for (int i = 0; i < steps_a_second; ++i) moving.brake();
    EXPECT_EQ(distance(stands, moving.pose()), 0);
  }
}

TEST(robot, drives_on_along_its_path_after_it_stood) {
  robot moving;
  for (int i = 0; i < 5 * steps_a_second; ++i) moving.step();
  for (int i = 0; i < 5 * steps_a_second; ++i) moving.brake();
  double worst = 0;
  for (int i = 0; i < 60 * steps_a_second; ++i) {
    moving.step();
    ASSERT_GE(moving.twist().forward, -1e-3) << "it backs up in step " << i;
    if (i > 5 * steps_a_second) worst = std::max(worst, distance(moving.pose(), moving.reference()));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(robot, integrates_its_pose_along_the_heading_halfway_through_each_step) {
  robot moving;
  for (int i = 0; i < 30 * steps_a_second; ++i) {
    const planar_pose from = moving.pose();
    moving.step();
    const planar_twist twist = moving.twist();
    const double halfway = from.heading + twist.turn * robot::period / 2;
    ASSERT_DOUBLE_EQ(moving.pose().x, from.x + twist.forward * robot::period * std::cos(halfway));
    ASSERT_DOUBLE_EQ(moving.pose().y, from.y + twist.forward * robot::period * std::sin(halfway));
    ASSERT_LE(std::abs(moving.pose().heading), std::numbers::pi);
  }
}

TEST(robot, drives_at_the_speed_that_was_set) {
  for (const double speed : {0.25, robot::speed_max}) {
    robot moving;
    moving.set_speed(speed);
    double fastest = 0, worst = 0;
    for (int i = 0; i < 200 * steps_a_second; ++i) {
      moving.step();
      if (i < 10 * steps_a_second) continue; // it begins slower than its reference
      fastest = std::max(fastest, moving.twist().forward);
      worst = std::max(worst, distance(moving.pose(), moving.reference()));
    }
    EXPECT_NEAR(fastest, speed, 0.03);
    EXPECT_LT(worst, 0.1);
  }
}

TEST(robot, stands_still_at_no_speed_and_goes_on_from_there) {
  robot moving;
  for (int i = 0; i < 10 * steps_a_second; ++i) moving.step();
  moving.set_speed(0);
  for (int i = 0; i < 10 * steps_a_second; ++i) moving.step();
  const planar_pose stopped = moving.pose();
  for (int i = 0; i < 10 * steps_a_second; ++i) moving.step();
  EXPECT_LT(distance(moving.pose(), stopped), 0.001);
  moving.set_speed(0.5);
  for (int i = 0; i < 5 * steps_a_second; ++i) moving.step();
  EXPECT_GT(distance(moving.pose(), stopped), 0.5);
}

TEST(robot, is_the_same_each_time) {
  robot one, other;
  for (int i = 0; i < 10 * steps_a_second; ++i) one.step(), other.step();
  EXPECT_EQ(one.pose().x, other.pose().x);
  EXPECT_EQ(one.pose().heading, other.pose().heading);
}

TEST(robot, is_driven_and_begins_its_figure_where_it_was_left) {
  robot moving;
  for (int i = 0; i < 3 * steps_a_second; ++i) moving.drive({0.5, 0});
  EXPECT_NEAR(moving.twist().forward, 0.5, 1e-3);
  for (int i = 0; i < 2 * steps_a_second; ++i) moving.brake();
  EXPECT_EQ(moving.twist().forward, 0);
  const planar_pose left = moving.pose();
  moving.step();
  EXPECT_LT(distance(left, moving.reference()), 0.001);
  double worst = 0;
  for (int i = 0; i < 60 * steps_a_second; ++i) {
    moving.step();
    if (i > 5 * steps_a_second) worst = std::max(worst, distance(moving.pose(), moving.reference()));
    ASSERT_LT(distance(moving.pose(), left), 2 * robot::half_length + 0.2);
  }
  EXPECT_LT(worst, 0.05);
}

} // namespace
} // namespace robot_test
} // namespace rowe::tools
