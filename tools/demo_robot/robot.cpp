// SPDX-License-Identifier: Apache-2.0
#include "robot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rowe::tools {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double phase_rate = 2 * pi / robot::lap; // rad/s

// How strongly an error along the path, across it, and of the heading is corrected.
constexpr double along_gain = 2.0;   // 1/s
constexpr double across_gain = 6.0;  // 1/m^2
constexpr double heading_gain = 4.0; // 1/m

// How much of the way to its command a wheel goes in one period.
const double lag_share = 1 - std::exp(-robot::period / robot::wheel_lag);

struct motion {
  planar_pose pose;
  planar_twist twist;
};

double wrapped(double angle) noexcept { return std::remainder(angle, 2 * pi); }

// Where a lap leads at `time`, and how fast when the time passes at `pace`.
motion figure_of_eight(double time, double pace) noexcept {
  const double a = robot::half_length;
  const double u = phase_rate * time;
  const double vx = a * phase_rate * std::cos(u);
  const double vy = a * phase_rate * std::cos(2 * u);
  const double ax = -a * phase_rate * phase_rate * std::sin(u);
  const double ay = -2 * a * phase_rate * phase_rate * std::sin(2 * u);
  const double speed_squared = vx * vx + vy * vy;
  return {.pose = {a * std::sin(u), a / 2 * std::sin(2 * u), std::atan2(vy, vx)},
          .twist = {pace * std::sqrt(speed_squared), pace * (vx * ay - vy * ax) / speed_squared}};
}

planar_twist tracking(const motion& wanted, const planar_pose& is) noexcept {
  const double dx = wanted.pose.x - is.x;
  const double dy = wanted.pose.y - is.y;
  const double along = std::cos(is.heading) * dx + std::sin(is.heading) * dy;
  const double across = -std::sin(is.heading) * dx + std::cos(is.heading) * dy;
  const double off = wrapped(wanted.pose.heading - is.heading);
  return {.forward = wanted.twist.forward * std::cos(off) + along_gain * along,
          .turn = wanted.twist.turn +
                  wanted.twist.forward * (across_gain * across + heading_gain * std::sin(off))};
}

constexpr double change_max = robot::wheel_acceleration_max * robot::period; // m/s, of a command in a step
constexpr double standing = 1e-6;                                            // m/s

double limited(double wanted, double last) noexcept {
  const double speed = std::clamp(wanted, -robot::wheel_speed_max, robot::wheel_speed_max);
  return std::clamp(speed, last - change_max, last + change_max);
}

// At the crossing both components of the velocity are a times the phase rate.
constexpr double speed_at_pace_1 = robot::half_length * phase_rate * std::numbers::sqrt2;

// What is known in the frame of `origin`, seen from outside.
planar_pose placed(const planar_pose& origin, const planar_pose& of) noexcept {
  const double c = std::cos(origin.heading);
  const double s = std::sin(origin.heading);
  return {origin.x + c * of.x - s * of.y, origin.y + s * of.x + c * of.y,
          wrapped(origin.heading + of.heading)};
}

} // namespace

robot::robot() noexcept : pose_{figure_of_eight(0, 1).pose} {}

planar_pose robot::reference() const noexcept { return placed(origin_, figure_of_eight(time_, pace_).pose); }

void robot::begin_figure() noexcept {
  time_ = 0; // at the origin of its frame
  origin_ = {pose_.x, pose_.y, wrapped(pose_.heading - figure_of_eight(0, 1).pose.heading)};
  led_off_ = false;
}

planar_twist robot::twist() const noexcept {
  return {.forward = (wheels_.left + wheels_.right) / 2, .turn = (wheels_.right - wheels_.left) / track};
}

void robot::set_speed(double speed) noexcept { pace_ = speed / speed_at_pace_1; }
double robot::speed() const noexcept { return pace_ * speed_at_pace_1; }

void robot::command(const planar_twist& wanted) noexcept {
  commanded_ = {limited(wanted.forward - wanted.turn * track / 2, commanded_.left),
                limited(wanted.forward + wanted.turn * track / 2, commanded_.right)};
}

void robot::step() noexcept {
  if (led_off_) begin_figure();
  motion next = figure_of_eight(time_, pace_);
  next.pose = placed(origin_, next.pose);
  command(tracking(next, pose_));
  move(pace_ * period);
}

void robot::drive(const planar_twist& commanded) noexcept {
  led_off_ = true;
  command(commanded);
  move(0);
}

void robot::brake() noexcept {
  // Both wheels slow down in one proportion, so that it does not turn off its curve. The reference goes only
  // as far as the robot still rolls; otherwise it would have to catch up, or to back up, afterwards.
  const double fastest = std::max(std::abs(commanded_.left), std::abs(commanded_.right));
  const double kept = std::max(fastest - change_max, 0.0) / std::max(fastest, change_max);
  commanded_ = {commanded_.left * kept, commanded_.right * kept};
  move(twist().forward / figure_of_eight(time_, 1).twist.forward * period);
  if (kept == 0 && std::abs(wheels_.left) + std::abs(wheels_.right) < standing) wheels_ = {};
}

void robot::move(double time) noexcept {
  wheels_.left += lag_share * (commanded_.left - wheels_.left);
  wheels_.right += lag_share * (commanded_.right - wheels_.right);

  const planar_twist moved = twist();
  const double halfway = pose_.heading + moved.turn * period / 2;
  pose_.x += moved.forward * period * std::cos(halfway);
  pose_.y += moved.forward * period * std::sin(halfway);
  pose_.heading = wrapped(pose_.heading + moved.turn * period);

  time_ += time;
  if (time_ >= lap) time_ -= lap;
  if (time_ < 0) time_ += lap; // it rolled back a little
}

} // namespace rowe::tools
