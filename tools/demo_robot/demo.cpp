// SPDX-License-Identifier: Apache-2.0
#include "demo.hpp"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include <rowe/rt/periodic.hpp>

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration cycle = 1ms;
static_assert(std::chrono::duration<double>{cycle}.count() == robot::period);

// After a pause (a stopped process, a suspended laptop) the robot does not catch up for longer than this.
constexpr std::int64_t steps_per_cycle_max = 20;

constexpr double turn_max = 2; // rad/s, of a command

// What a wheel odometry of this size would claim: 1 cm, 1 cm, 1 degree; nothing is known of the other axes.
constexpr double place_variance = 1e-4;     // m^2
constexpr double heading_variance = 3e-4;   // rad^2
constexpr double speed_variance = 1e-4;     // (m/s)^2
constexpr double turn_variance = 4e-4;      // (rad/s)^2
constexpr double unobserved_variance = 1e6; // ROS's custom for axes that are not measured

ros::covariance6 diagonal(double along, double across, double about) noexcept {
  ros::covariance6 matrix{};
  const std::array<double, 6> variances{
      along, across, unobserved_variance, unobserved_variance, unobserved_variance, about};
  for (std::size_t i = 0; i < variances.size(); ++i) matrix[i * 7] = variances[i];
  return matrix;
}

// What stays the same in all messages.
ros::odometry blank_message() noexcept {
  ros::odometry message;
  message.header.frame_id = "odom";
  message.child_frame_id = "base_link";
  message.pose.covariance = diagonal(place_variance, place_variance, heading_variance);
  message.twist.covariance = diagonal(speed_variance, unobserved_variance, turn_variance);
  return message;
}

// Stamps are wall-clock time as it was known when the loop began, so that they never jump.
rt::duration wall_clock_offset() noexcept {
  timespec wall;
  ::clock_gettime(CLOCK_REALTIME, &wall);
  return std::chrono::seconds{wall.tv_sec} + std::chrono::nanoseconds{wall.tv_nsec} -
         rt::monotonic_clock::now().time_since_epoch();
}

ros::time stamp_of(rt::duration since_1970) noexcept {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since_1970);
  return {static_cast<std::uint32_t>(seconds.count()),
          static_cast<std::uint32_t>((since_1970 - seconds).count())};
}

void describe(const robot& moving, ros::odometry& in) noexcept {
  const planar_pose& pose = moving.pose();
  in.pose.pose.position = {pose.x, pose.y, 0};
  in.pose.pose.orientation = {0, 0, std::sin(pose.heading / 2), std::cos(pose.heading / 2)};
  const planar_twist twist = moving.twist();
  in.twist.twist.linear.x = twist.forward;
  in.twist.twist.angular.z = twist.turn;
}

// The last core that this process may use and that is not `other`; nothing where it has one only.
std::optional<int> core_besides(int other) noexcept {
  cpu_set_t allowed;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return std::nullopt;
  for (int cpu = CPU_SETSIZE - 1; cpu >= 0; --cpu) {
    if (cpu != other && CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) return cpu;
  }
  return std::nullopt;
}

} // namespace

stop_options demo::stop_of(bool guarded) noexcept {
  return {.guard_timeout = 1s, .service_timeout = 500ms, .observe_timeout = 500ms, .unguarded = !guarded};
}

result<demo::handles> demo::open(endpoint& on, rt::duration service_timeout) {
  auto odom =
      on.advertise<ros::odometry>(topic, {.ttl = 100ms, .keep = keep::all, .depth = 64, .period = cycle});
  if (!odom) return odom.error();
  auto speed = on.serve<speed_setting, speed_setting>(service, {.type = "rowe_demo/SetSpeed"});
  if (!speed) return speed.error();
  auto latch = on.stop_latch({.name = "robot", .loop_timeout = std::max(loop_timeout, service_timeout)});
  if (!latch) return latch.error();
  auto speed_max = on.parameter<double>(limit, robot::speed_max, {0, robot::speed_max});
  if (!speed_max) return speed_max.error();
  auto driven = on.subscribe<ros::twist>(commands, {.lease = lease});
  if (!driven) return driven.error();
  auto by_itself = on.parameter<bool>(autopilot, true);
  if (!by_itself) return by_itself.error();
  return handles{std::move(*odom),      std::move(*speed),  std::move(*latch),
                 std::move(*speed_max), std::move(*driven), std::move(*by_itself)};
}

demo::demo(handles through, int service_cpu)
    : through_{std::move(through)},
      thread_{{.name = "robot", .cpu = core_besides(service_cpu), .priority = priority}, [this] { run(); }} {}

// One request a cycle is plenty, and bounds it.
void demo::answer(robot& moving, rt::time_point now) noexcept {
  if (through_.speed_max.refresh()) moving.set_speed(std::min(moving.speed(), through_.speed_max.get()));
  auto request = through_.speed.try_next(now);
  if (!request) return;
  const speed_setting asked = request->value();
  if (asked.speed >= 0 && asked.speed <= through_.speed_max.get()) {
    moving.set_speed(asked.speed);
    (void)through_.speed.reply(*request, asked, now); // who has gone needs no answer
  } else if (asked.speed >= 0 && asked.speed <= robot::speed_max) {
    (void)through_.speed.refuse(*request, "the speed is above the parameter /robot/speed_max", now);
  } else {
    (void)through_.speed.refuse(*request, "the speed is out of range: 0 to 1 m/s", now);
  }
}
static_assert(robot::speed_max == 1, "the sentence above says so");

// The newest word counts: a command ends the figure until somebody asks for it again.
void demo::move(robot& moving, std::int64_t steps, rt::time_point now) noexcept {
  std::optional<planar_twist> commanded;
  if (const auto command = through_.commands.latest_within(now)) {
    const double fastest = through_.speed_max.get();
    commanded = planar_twist{std::clamp(command->value().linear.x, -fastest, fastest),
                             std::clamp(command->value().angular.z, -turn_max, turn_max)};
    if (through_.autopilot.get()) (void)through_.autopilot.set(false);
  }
  const bool by_itself = through_.autopilot.get();
  while (steps-- > 0) {
    if (commanded) {
      moving.drive(*commanded);
    } else if (by_itself) {
      moving.step();
    } else {
      moving.brake();
    }
  }
}

void demo::run() noexcept {
  rt::periodic loop{cycle};
  robot moving;
  ros::odometry message = blank_message();
  const rt::duration wall_offset = wall_clock_offset();
  std::uint64_t steps = 0;
  while (const auto now = loop.wait()) {
    // acquire: pairs with the release in stop()
    if (stopping_.load(std::memory_order_acquire)) break;
    const auto due = static_cast<std::int64_t>(loop.cycles() + loop.overruns() - steps);
    answer(moving, *now);
    const bool stopped = through_.latch.engaged(*now);
    if (stopped) {
      for (std::int64_t left = std::min(due, steps_per_cycle_max); left > 0; --left) moving.brake();
      through_.latch.acknowledge(*now); // the brakes are on
    } else {
      move(moving, std::min(due, steps_per_cycle_max), *now);
    }
    steps += static_cast<std::uint64_t>(due);

    describe(moving, message);
    message.header.stamp = stamp_of(now->time_since_epoch() + wall_offset);
    (void)through_.odom.publish(message, *now); // losing one is fine, and counted
    ++message.header.seq;
  }
  report_ = {.cycles = loop.cycles(),
             .skipped = loop.overruns(),
             .late_p50 = loop.lateness().percentile(50),
             .late_p99 = loop.lateness().percentile(99),
             .late_max = loop.lateness().max(),
             .published = through_.odom.published(),
             .refused = through_.odom.dropped_full()};
}

demo_report demo::stop() noexcept {
  stopping_.store(true, std::memory_order_release); // release: pairs with the acquire in run()
  thread_.join();
  return report_;
}

} // namespace rowe::tools
