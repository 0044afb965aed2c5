// SPDX-License-Identifier: Apache-2.0
// A robot of your own, to begin from: your_own_robot [PORT]. docs/your-own-robot.md shows it part by part.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <string_view>
#include <system_error>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

// ---- what goes over the network

struct state { double stamp, x, y, heading, speed; };     // seconds, metres, radians, m/s
template <> inline constexpr auto rowe::schema<state> =   // list the members; the names follow
    rowe::fields<&state::stamp, &state::x, &state::y, &state::heading, &state::speed>{}
        .type("my_robot/State");

struct place { double x, y, heading; };
template <> inline constexpr auto rowe::schema<place> =
    rowe::fields<&place::x, &place::y, &place::heading>{};

// ---- the robot: yours; here, one that does at once what it is told

class base {
 public:
  void drive(double speed, double turn, double seconds) noexcept {
    speed_ = speed;
    at_.heading = std::remainder(at_.heading + turn * seconds, 2 * M_PI);
    at_.x += speed * std::cos(at_.heading) * seconds;
    at_.y += speed * std::sin(at_.heading) * seconds;
  }
  void brake() noexcept { speed_ = 0; }
  void put(const place& there) noexcept { at_ = there; }
  state measure(rowe::time_point now) const noexcept {
    const double stamp = std::chrono::duration<double>(now.time_since_epoch()).count();
    return {stamp, at_.x, at_.y, at_.heading, speed_};
  }

 private:
  place at_{};
  double speed_ = 0;
};

int main(int count, char** words) {
  // ---- set-up: it may wait and allocate, and says what is wrong
  rowe::endpoint_options options;
  options.name = "my-robot";
  options.stop.unguarded = true; // a reset alone lets it drive; without this, somebody must guard it, too
  std::uint16_t port = 8080;
  if (count > 1) {
    const std::string_view said = words[1];
    const auto read = std::from_chars(said.data(), said.data() + said.size(), port);
    if (read.ec != std::errc{} || read.ptr != said.data() + said.size())
      return std::fprintf(stderr, "a port is a number from 0 to 65535, not '%s'\n", words[1]), 2;
  }
  auto robot = rowe::endpoint::listen(port, options);
  if (!robot) return std::fprintf(stderr, "%s\n", robot.error().message().c_str()), 1;

  static rowe::rt::periodic loop{1ms, {.priority = 80}};
  std::signal(SIGINT, [](int) { loop.stop(); }); // Ctrl-C
  std::signal(SIGTERM, [](int) { loop.stop(); });

  auto states = robot->advertise<state>("/state", {.ttl = 20ms, .keep = rowe::keep::newest}).value();
  auto commands = robot->subscribe<rowe::ros::twist>(
      "/cmd_vel", {.keep = rowe::keep::newest, .fill_missing = true}).value();
  auto set_place = robot->serve<place, place>("/set_place").value();
  auto speed_max = robot->parameter<double>("/speed_max", 0.5, {0, 2}).value();
  auto latch = robot->stop_latch({.name = "base"}).value();

  std::printf("http://127.0.0.1:%d/\n", robot->port());
  char granted[rowe::rt::grants::text_bytes_max];
  const auto loop_text = loop.grants().text(granted);
  std::printf("control loop: %.*s\n", static_cast<int>(loop_text.size()), loop_text.data());
  char times[rowe::stop_times::text_bytes_max];
  const auto stop_text = latch.times().text(times);
  std::printf("stop: %.*s\n", static_cast<int>(stop_text.size()), stop_text.data());
  (void)std::fflush(stdout);

  // ---- the loop: from here on nothing waits, allocates or locks
  base wheels;
  rowe::ros::twist wanted;
  rowe::time_point commanded{};
  while (const auto now = loop.wait()) {
    if (const auto command = commands.try_take(*now)) {
      wanted = command->value();
      commanded = *now;
    }
    if (*now - commanded > 500ms) wanted = {}; // who drives says so again and again

    if (auto request = set_place.try_next(*now)) {
      const place there = request->value();
      if (std::hypot(there.x, there.y) > 100) {
        (void)set_place.refuse(*request, "at most 100 m from here", *now); // who asked may be gone by now
      } else {
        wheels.put(there);
        (void)set_place.reply(*request, there, *now);
      }
    }

    if (latch.engaged(*now)) {
      wheels.brake();
      latch.acknowledge(*now);
    } else {
      const double most = speed_max.get();
      wheels.drive(std::clamp(wanted.linear.x, -most, most), wanted.angular.z, 1e-3);
    }

    (void)states.publish(wheels.measure(*now), *now); // losing one is fine, and counted
  }

  (void)robot->close(200ms); // what was published last is sent; the peers learn that we go
  std::puts("stopped");
}
