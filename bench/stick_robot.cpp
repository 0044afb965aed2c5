// SPDX-License-Identifier: Apache-2.0
// The robot of bench/stick.js: a loop of 1 kHz with a lease that says `port N` first, then `seen X NS`
// (CLOCK_REALTIME, in that cycle) for each command that it has not had before. It publishes odometry in every
// cycle, and so many bytes of telemetry as its argument says. Ends with its input.
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

int main(int count, char** arguments) {
  using namespace std::chrono_literals;
  const auto bytes = static_cast<std::size_t>(count > 1 ? std::atoi(arguments[1]) : 0);
  auto robot = rowe::endpoint::listen(0).value();
  auto odom = robot.advertise<rowe::ros::odometry>("/odom", {.ttl = 100ms}).value();
  auto telemetry = robot.advertise<rowe::json_text>("/telemetry", {.ttl = 100ms}).value();
  auto commands = robot.subscribe<rowe::ros::twist>("/cmd_vel", {.lease = 300ms}).value();
  const std::string text = R"({"text":")" + std::string(bytes, 'x') + R"("})";
  std::printf("port %d\n", robot.port());
  std::fflush(stdout);
  double last = 0;
  rowe::rt::periodic loop{1ms, {.priority = 80}};
  for (pollfd typed{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0}; ::poll(&typed, 1, 0) == 0;) {
    const auto now = loop.wait();
    if (!now) return 1;
    if (const auto command = commands.latest_within(*now); command && command->value().linear.x != last) {
      last = command->value().linear.x;
      timespec wall;
      ::clock_gettime(CLOCK_REALTIME, &wall);
      std::printf("seen %.6f %lld\n", last, wall.tv_sec * 1'000'000'000LL + wall.tv_nsec);
      std::fflush(stdout);
    }
    (void)odom.publish({}, *now); // losing one is fine, and counted
    if (bytes != 0) (void)telemetry.publish(text, *now);
  }
}
