// SPDX-License-Identifier: Apache-2.0
// `rowe serve --demo`: a real-time loop of 1 kHz that steps the simulated robot, publishes where it is, lets
// its speed be set, is driven, and obeys the stop, as a real one would: a thread of its own with a priority,
// a core and locked memory as far as the machine grants them, absolute deadlines, and nothing in a cycle but
// arithmetic, one look at the stop, one for a request, and one publish.
#pragma once
#include <atomic>
#include <cstdint>

#include <rowe/endpoint.hpp>
#include <rowe/ros.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "robot.hpp"

namespace rowe::tools {

// What the loop did, for people.
struct demo_report {
  std::uint64_t cycles = 0;
  std::uint64_t skipped = 0; // periods that passed without a cycle
  rt::duration late_p50{};   // against the cycle's deadline
  rt::duration late_p99{};
  rt::duration late_max{};
  std::uint64_t published = 0;
  std::uint64_t refused = 0; // the queue to the service thread was full
};

// The request and the reply of the service /robot/set_speed, in m/s.
struct speed_setting {
  double speed = 0;
};

} // namespace rowe::tools

template <>
inline constexpr auto rowe::schema<rowe::tools::speed_setting> =
    rowe::fields<&rowe::tools::speed_setting::speed>{};

namespace rowe::tools {

class demo {
 public:
  static constexpr int priority = 80;
  static constexpr std::string_view topic = "/odom";
  static constexpr std::string_view service = "/robot/set_speed";
  static constexpr std::string_view limit = "/robot/speed_max"; // a parameter
  // Where it is driven, in metres and radians a second; and for how long a command is in force. A command
  // ends the figure of eight, and this parameter begins it again.
  static constexpr std::string_view commands = "/cmd_vel";
  static constexpr rt::duration lease = std::chrono::milliseconds{500};
  static constexpr std::string_view autopilot = "/robot/autopilot";

  // The stop of such a robot: it drives on ordinary machines, busy laptops among them, and phones guard it
  // over their Wi-Fi; so its limits are wider than a real robot's.
  static constexpr rt::duration loop_timeout = std::chrono::milliseconds{500};
  static stop_options stop_of(bool guarded) noexcept;

  // What the loop speaks through.
  struct handles {
    publisher<ros::odometry> odom; // every value is wanted, but none that is older than a tenth of a second
    responder<speed_setting, speed_setting> speed;
    stop_latch latch;
    parameter<double> speed_max; // m/s
    subscriber<ros::twist> commands;
    parameter<bool> autopilot; // it drives along its figure when nobody commands it
  };
  // The stop bears as much of a late loop as of a late service thread, if that is more than loop_timeout.
  static result<handles> open(endpoint& on, rt::duration service_timeout);

  // Starts the loop; error() says if no thread could be had. `service_cpu` is the core that the loop keeps
  // off where there is another; negative: none.
  demo(handles through, int service_cpu);
  demo(const demo&) = delete;
  demo& operator=(const demo&) = delete;
  ~demo() { stop(); }

  int error() const noexcept { return thread_.error(); }
  const rt::grants& grants() const noexcept { return thread_.grants(); }

  // Ends the loop within a period.
  demo_report stop() noexcept;

 private:
  void run() noexcept;
  void answer(robot& moving, rt::time_point now) noexcept;
  // What moves it in this cycle; nothing: it stands still.
  void move(robot& moving, std::int64_t steps, rt::time_point now) noexcept;

  handles through_;
  std::atomic<bool> stopping_{false};
  demo_report report_; // written by the loop as it ends, read once it is joined
  rt::thread thread_;  // last: it begins when all the rest is there
};

} // namespace rowe::tools
