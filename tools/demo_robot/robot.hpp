// SPDX-License-Identifier: Apache-2.0
// A robot that exists only as numbers: a differential drive that follows a figure of eight for ever. Pure
// arithmetic on its own state; no clock, no thread, no allocation, so that a real-time loop can step it.
//
// Each step, of `period`:
//   1. the reference runs along a lemniscate of Gerono, x = a sin u, y = a/2 sin 2u, u = 2 pi t / lap;
//   2. the tracking law of Kanayama et al. (A stable tracking control method for an autonomous mobile robot,
//   ICRA
//      1990) turns the reference's velocity and the error against it into the body's;
//   3. that becomes wheel speeds, limited in speed and in how fast they change;
//   4. each wheel follows its command with a first-order lag;
//   5. the pose is integrated once with the midpoint rule: along the heading halfway through the step.
// Steps 2 to 4 are why it starts gently, cuts no corner and does not drift off in hours.
#pragma once

namespace rowe::tools {

struct planar_pose {
  double x = 0;       // metres
  double y = 0;       // metres
  double heading = 0; // radians, counter-clockwise from x, in (-pi, pi]
};

struct planar_twist {
  double forward = 0; // m/s
  double turn = 0;    // rad/s
};

struct wheel_speeds {
  double left = 0;  // m/s at the rim
  double right = 0; // m/s at the rim
};

class robot {
 public:
  static constexpr double period = 0.001;             // s, of a step
  static constexpr double lap = 24.0;                 // s, of the whole figure, at the usual speed
  static constexpr double half_length = 2.0;          // m, a
  static constexpr double track = 0.40;               // m, between the wheels
  static constexpr double wheel_speed_max = 1.2;      // m/s
  static constexpr double wheel_acceleration_max = 2; // m/s^2, of the command
  static constexpr double wheel_lag = 0.05;           // s, time constant
  static constexpr double speed_max = 1.0;            // m/s, that can be set

  // Stands at the crossing of the eight, looking along it.
  robot() noexcept;

  // Its speed where the figure is fastest, from here on, in m/s; 0 lets it stand. From 0 to speed_max.
  void set_speed(double speed) noexcept;
  double speed() const noexcept;

  // Lets one period pass: drives on along the figure. After drive() the figure begins anew where it is.
  void step() noexcept;
  // Lets one period pass: as somebody commands it, as far as its wheels can.
  void drive(const planar_twist& commanded) noexcept;
  // The same with the brakes on: slows down as fast as it may, along its curve, and stands. step() drives on
  // from there.
  void brake() noexcept;

  const planar_pose& pose() const noexcept { return pose_; }
  const wheel_speeds& wheels() const noexcept { return wheels_; }
  planar_twist twist() const noexcept;
  // Where it ought to be now.
  planar_pose reference() const noexcept;

 private:
  // The wheels follow their commands, the pose follows the wheels, and `time` passes for the reference.
  void move(double time) noexcept;
  void command(const planar_twist& wanted) noexcept;
  // The figure from here on begins at its crossing, where the robot is and as it looks.
  void begin_figure() noexcept;

  double time_ = 0;      // within the lap
  double pace_ = 1;      // how fast it passes
  planar_pose origin_;   // of the figure
  bool led_off_ = false; // by drive()
  planar_pose pose_;
  wheel_speeds commanded_;
  wheel_speeds wheels_;
};

} // namespace rowe::tools
