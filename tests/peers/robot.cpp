// SPDX-License-Identifier: Apache-2.0
// A robot for foreign peers to talk to, by the public interface alone and in the loop that every robot has:
//
//   peers_robot listen PROFILE          at a port of its own choice
//   peers_robot drive PROFILE           likewise, and listens to topics
//   peers_robot connect PROFILE URL     as a client
//
// until SIGTERM. It prints a line with its port when it is ready. It provides add-two-numbers ({"a","b"}
// gives {"result"}) and /mine (std_srvs/SetBool), and sends every plain message that comes to every peer that
// takes some. One that drives publishes on /driven what it was told on /cmd_vel, all of it, or on
// /cmd_vel_lenient, as much as there was; and on /odom1 and /odom2, in the shapes of ROS 1 and ROS 2, what
// came on /odom in either of them.
#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

struct two_numbers {
  std::int64_t a, b;
};
template <>
inline constexpr auto rowe::schema<two_numbers> = rowe::fields<&two_numbers::a, &two_numbers::b>{};

struct sum {
  std::int64_t result;
};
template <>
inline constexpr auto rowe::schema<sum> = rowe::fields<&sum::result>{};

struct wanted {
  bool data;
};
template <>
inline constexpr auto rowe::schema<wanted> = rowe::fields<&wanted::data>{};

struct done {
  bool success;
  rowe::fixed_string<16> message;
};
template <>
inline constexpr auto rowe::schema<done> = rowe::fields<&done::success, &done::message>{};

namespace {

using namespace std::chrono_literals;

constexpr done on{true, "on"}, off{true, "off"};

rowe::rt::periodic loop{1ms};

extern "C" void end(int) { loop.stop(); }

rowe::websocket_profile profile_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, rowe::websocket_profile>, 3> profiles{
      {{"standard", rowe::websocket_profile::standard},
       {"hop", rowe::websocket_profile::hop},
       {"hop_2014", rowe::websocket_profile::hop_2014}}};
  for (const auto& [one, profile] : profiles)
    if (one == name) return profile;
  std::fprintf(stderr, "there is no profile %.*s\n", static_cast<int>(name.size()), name.data());
  std::exit(2);
}

// What a robot that drives has besides.
class driver {
 public:
  explicit driver(rowe::endpoint& robot)
      : strict_{robot.subscribe<rowe::ros::twist>("/cmd_vel", {.depth = 8, .fill_missing = false}).value()},
        lenient_{robot.subscribe<rowe::ros::twist>("cmd_vel_lenient", few).value()},
        odometry_{robot.subscribe<rowe::ros::odometry>("/odom", few).value()},
        driven_{robot.advertise<rowe::ros::twist>("/driven", few).value()},
        odometry1_{robot.advertise<rowe::ros::odometry>("/odom1", few).value()},
        odometry2_{robot.advertise<rowe::ros2::odometry>("/odom2", few).value()} {}

  // What nobody listens to is not to be heard.
  void turn(rowe::time_point now) {
    for (auto* one : {&strict_, &lenient_})
      while (auto told = one->try_take()) (void)driven_.publish(told->value(), now);
    while (auto told = odometry_.try_take()) {
      const rowe::ros::odometry& one = told->value();
      const rowe::ros2::time stamp{static_cast<std::int32_t>(one.header.stamp.secs), one.header.stamp.nsecs};
      (void)odometry1_.publish(one, now);
      (void)odometry2_.publish({{stamp, one.header.frame_id}, one.child_frame_id, one.pose, one.twist}, now);
    }
  }

 private:
  static constexpr rowe::topic_options few{.depth = 8};
  rowe::subscriber<rowe::ros::twist> strict_, lenient_;
  rowe::subscriber<rowe::ros::odometry> odometry_;
  rowe::publisher<rowe::ros::twist> driven_;
  rowe::publisher<rowe::ros::odometry> odometry1_;
  rowe::publisher<rowe::ros2::odometry> odometry2_;
};

void run(rowe::endpoint& robot, bool drives) {
  auto adds = robot.serve<two_numbers, sum>("add-two-numbers").value();
  auto mine = robot.serve<wanted, done>("/mine", {.type = "std_srvs/SetBool"}).value();
  auto mail = robot.open_lane({.depth = 16, .inbox_depth = 16, .calls = 4}).value();
  std::optional<driver> drive;
  if (drives) drive.emplace(robot);
  std::printf("ready at port %u\n", static_cast<unsigned>(robot.port())); // 0 as a client
  std::fflush(stdout);
  while (const auto now = loop.wait()) {
    while (auto asked = adds.try_next(*now))
      (void)adds.reply(*asked, {asked->value().a + asked->value().b}, *now); // who left needs no answer
    while (auto asked = mine.try_next(*now)) (void)mine.reply(*asked, asked->value().data ? on : off, *now);
    if (drive) drive->turn(*now);
    while (auto came = mail.try_receive(*now)) {
      if (came->wants_reply())
        (void)mail.try_refuse(*came, "not one of mine", *now);
      else if (!mail.try_send(came->value(), 1s, *now))
        std::fprintf(stderr, "a message was not sent\n");
    }
  }
}

} // namespace

int main(int argc, char** argv) {
  const std::string_view role = argc > 2 ? argv[1] : "";
  const bool drives = role == "drive";
  if (!((role == "listen" || drives) && argc == 3) && !(role == "connect" && argc == 4)) {
    std::fprintf(stderr, "usage: peers_robot listen|drive PROFILE | connect PROFILE URL\n");
    return 2;
  }
  std::signal(SIGTERM, end);
  const rowe::endpoint_options options{.profile = profile_of(argv[2])};
  auto robot =
      role == "connect" ? rowe::endpoint::connect(argv[3], options) : rowe::endpoint::listen(0, options);
  if (!robot) {
    std::fprintf(stderr, "no endpoint: error %d\n", static_cast<int>(robot.code()));
    return 1;
  }
  run(*robot, drives);
  return robot->close(1s) ? 0 : 1;
}
