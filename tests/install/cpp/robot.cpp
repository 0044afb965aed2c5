// SPDX-License-Identifier: Apache-2.0
// A robot that listens on any free port, and a peer that connects and reads one of its values over a socket.
#include <cstdio>
#include <string>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

struct odometry {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<odometry> = rowe::fields<&odometry::x, &odometry::y>{};

int main() {
  auto robot = rowe::endpoint::listen(0).value();
  auto odom = robot.advertise<odometry>("/odom").value();
  auto peer = rowe::endpoint::connect("ws://127.0.0.1:" + std::to_string(robot.port())).value();
  auto seen = peer.subscribe<odometry>("/odom").value();

  for (int attempt = 0; attempt < 600; ++attempt) { // until the robot knows who listens
    (void)odom.publish({1.5, -2});
    if (const auto value = seen.take(100ms)) {
      const auto [x, y] = value->value();
      std::printf("x %g, y %g\n", x, y);
      return robot.close(1s) ? 0 : 1;
    }
  }
  return 1;
}
