// SPDX-License-Identifier: Apache-2.0
// A loop of 1 kHz that somebody drives: drive PORT. It obeys geometry_msgs/Twist on /cmd_vel while a command
// is in force, stands still otherwise, and never goes faster than the parameter /speed_max. The page, roslib
// and `rowe pub` drive it. It may move without a guard; `rowe reset` lets it, the first time too.
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

// Yours: here, words for whoever watches.
static void say(const char* words, double speed = 0) {
  static const char* said = nullptr;
  static double last = 0;
  if (words == said && speed == last) return;
  std::printf("%s %.2f\n", said = words, last = speed);
  (void)std::fflush(stdout);
}
static void brake() { say("braking at"); }
static void stand_still() { say("standing still at"); }
static void drive(double speed) { say("driving at", speed); }

int main(int count, char** words) {
  const std::string_view said = count == 2 ? words[1] : "";
  std::uint16_t port = 0;
  const auto read = std::from_chars(said.data(), said.data() + said.size(), port);
  if (said.empty() || read.ec != std::errc{} || read.ptr != said.data() + said.size())
    return std::fprintf(stderr, "usage: drive PORT; a port is a number from 0 to 65535\n"), 2;
  rowe::endpoint_options options;
  options.stop.unguarded = true;
  auto robot = rowe::endpoint::listen(port, options).value();
  std::printf("listening on port %d\n", robot.port());

  rowe::rt::periodic loop{1ms};
  auto latch = robot.stop_latch({.name = "base"}).value();
  auto fastest = robot.parameter<double>("/speed_max", 0.5, {0, 2}).value();
  auto commands = robot.subscribe<rowe::ros::twist>("/cmd_vel", {.lease = 300ms}).value();
  while (auto now = loop.wait()) {
    if (latch.engaged(*now)) {
      brake();
      latch.acknowledge(*now);
    } else if (const auto command = commands.latest_within(*now)) {
      drive(std::clamp(command->value().linear.x, -fastest.get(), fastest.get()));
    } else {
      stand_still();
    }
  }
}
