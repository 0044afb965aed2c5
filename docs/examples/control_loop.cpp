// SPDX-License-Identifier: Apache-2.0
// A control loop of 1 kHz whose odometry is seen in a browser: run it and open http://127.0.0.1:8080/.
#include <cmath>
#include <csignal>
#include <iostream>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

struct odometry { double stamp, x, y, heading, speed; };          // seconds, metres, radians, m/s
template <> inline constexpr auto rowe::schema<odometry> =        // list the members; the names follow
    rowe::fields<&odometry::stamp, &odometry::x, &odometry::y, &odometry::heading, &odometry::speed>{};

static odometry measure(rowe::time_point now) {                   // yours: here, a circle of 1 m at 0.5 m/s
  const double stamp = std::chrono::duration<double>(now.time_since_epoch()).count(), angle = 0.5 * stamp;
  return {stamp, std::cos(angle), std::sin(angle), std::remainder(angle + M_PI_2, 2 * M_PI), 0.5};
}

int main() {
  auto robot = rowe::endpoint::listen(8080, {.service_cpu = 0});  // set-up may fail, loops never do
  if (!robot) return std::cerr << robot.error().message() << '\n', 1; // port 8080 is in use ...
  auto odom = robot->advertise<odometry>("/odom", {.ttl = 20ms, .keep = rowe::keep::newest}).value();
  static rowe::rt::periodic loop{1ms, {.cpu = 1, .priority = 80}};
  std::signal(SIGINT, [](int) { loop.stop(); });                  // Ctrl-C
  char buffer[rowe::rt::grants::text_bytes_max];                  // granted, or why not and what to do:
  std::cerr << "service thread: " << robot->service_grants().text(buffer) << '\n';
  std::cerr << "control loop: " << loop.grants().text(buffer) << '\n';
  while (auto now = loop.wait()) {                                // your loop, your thread; one clock read
    (void)odom.publish(measure(*now), *now);                      // losing one sample is fine, and counted
  }
}
