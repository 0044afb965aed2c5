// SPDX-License-Identifier: Apache-2.0
// A robot that records itself, and whose black box has what led to a stop: record FOLDER
#include <chrono>
#include <cstdio>
#include <string>

#include <rowe/recording.hpp>
#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

int main(int count, char** arguments) {
  if (count != 2) return std::fputs("usage: record FOLDER\n", stderr), 2;
  const std::string folder = arguments[1];
  auto robot = rowe::endpoint::listen(0).value();
  auto odom = robot.advertise<rowe::ros::odometry>("/odom", {.depth = 64}).value();

  std::string why;
  rowe::record_options all{.file = {.path = folder + "/", .split_time = 10min, .total_bytes = 50 << 20}};
  auto records = robot.record(all, &why);
  if (!records) return std::fprintf(stderr, "%s\n", why.c_str()), 1;
  auto box = robot.record({.file = {.path = folder + "/black_box/", .black_box = {.before = 30s}}}, &why);
  if (!box) return std::fprintf(stderr, "%s\n", why.c_str()), 1;

  rowe::rt::periodic loop{1ms, {.cycles_max = 100}};
  while (const auto now = loop.wait()) (void)odom.publish({}, *now); // which never waits for the disk
  (void)box->snapshot("to see one");                              // as a stop would
  if (!box->close(&why) || !records->close(&why)) return std::fprintf(stderr, "%s\n", why.c_str()), 1;
  const auto done = records->figures();
  std::printf("%llu messages, %llu lost\n", static_cast<unsigned long long>(done.messages),
              static_cast<unsigned long long>(done.lost));
}
