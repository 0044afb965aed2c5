// SPDX-License-Identifier: Apache-2.0
// rowe replay of a trajectory: publishes its poses at their own pace. Deadlines are absolute and come from
// the file's times, so the pace does not drift; every pose is sent: where there is no room, or no connection
// for a while, it waits. Only what was on its way when a connection broke may be lost; the summary counts it.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/ros.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../text/tum.hpp"
#include "replaying.hpp"
#include "sending.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t pose_queue_depth = 256;
constexpr std::int64_t ns_per_second = 1'000'000'000;

// When pose i of a lap is due, counted from the lap's begin; and how long a lap is.
class pose_times {
 public:
  pose_times(const std::vector<tum_pose>& poses, const rate_wish& wish) : poses_{poses} {
    const auto hz = wish.hz ? wish.hz : wish.plain;
    if (hz) period_ns_ = static_cast<double>(ns_per_second) / *hz;
    factor_ = wish.factor.value_or(1);
  }
  rt::duration due(std::size_t i) const noexcept {
    return period_ns_ ? scaled(i) : shortened(poses_[i].time_ns - poses_.front().time_ns);
  }
  // From one lap's first pose to the next one's: a step of mean length follows the last pose.
  rt::duration lap() const noexcept {
    return period_ns_ ? scaled(poses_.size()) : shortened(recorded_lap().count());
  }
  // By how much the stamps of a lap go on from those of the lap before.
  rt::duration recorded_lap() const noexcept {
    const std::int64_t span = poses_.back().time_ns - poses_.front().time_ns;
    const auto steps = static_cast<std::int64_t>(std::max<std::size_t>(poses_.size() - 1, 1));
    return rt::duration{span + span / steps};
  }

 private:
  rt::duration scaled(std::size_t i) const noexcept {
    return rt::duration{static_cast<std::int64_t>(static_cast<double>(i) * *period_ns_)};
  }

  rt::duration shortened(std::int64_t ns) const noexcept {
    return rt::duration{factor_ == 1.0 ? ns : static_cast<std::int64_t>(static_cast<double>(ns) / factor_)};
  }

  const std::vector<tum_pose>& poses_;
  std::optional<double> period_ns_;
  double factor_ = 1;
};

ros::odometry blank_message() noexcept {
  ros::odometry message; // twist and covariances stay zero: the file does not know them
  message.header.frame_id = "odom";
  message.child_frame_id = "base_link";
  return message;
}

void describe(const tum_pose& pose, rt::duration later, ros::odometry& in) noexcept {
  const std::int64_t stamp_ns = pose.time_ns + later.count();
  in.header.stamp = {static_cast<std::uint32_t>(stamp_ns / ns_per_second),
                     static_cast<std::uint32_t>(stamp_ns % ns_per_second)};
  in.pose.pose.position = {pose.position[0], pose.position[1], pose.position[2]};
  in.pose.pose.orientation = {pose.orientation[0], pose.orientation[1], pose.orientation[2],
                              pose.orientation[3]};
}

class pose_player {
 public:
  pose_player(publisher<ros::odometry> odom, remote& hub, const replay_options& chosen, const rate_wish& wish,
              const console& to)
      : odom_{std::move(odom)}, hub_{hub}, chosen_{chosen}, wish_{wish}, to_{to} {}

  // Plays the poses once, or again and again. Nothing: to the end.
  std::optional<exit_code> play(const std::vector<tum_pose>& poses) {
    const pose_times steps{poses, wish_};
    begin_ = rt::monotonic_clock::now();
    rt::duration later{0};
    do {
      for (std::size_t i = 0; i < poses.size(); ++i) {
        interrupt::sleep_until(begin_ + steps.due(i));
        if (interrupt::seen()) return exit_code::interrupted;
        describe(poses[i], later, message_);
        if (const auto end = send()) return end;
      }
      begin_ += steps.lap();
      later += steps.recorded_lap();
    } while (chosen_.loop);
    return std::nullopt;
  }

  std::uint64_t sent() const noexcept { return sent_; }

 private:
  // Sends the message, whatever it takes. Nothing: sent.
  std::optional<exit_code> send() {
    for (;;) {
      const auto now = rt::monotonic_clock::now();
      const status done = odom_.publish(message_, now);
      if (done) break;
      if (done.code() == errc::full) {
        interrupt::sleep_until(now + room_period);
      } else if (done.code() == errc::no_peer) {
        if (const auto end = hub_.wait(chosen_.timeout)) return end;
        begin_ += rt::monotonic_clock::now() - now; // the pace goes on where it was broken off
      } else {
        to_.error(done.error().message());
        return exit_code::failed;
      }
      if (interrupt::seen()) return exit_code::interrupted;
    }
    ++message_.header.seq;
    ++sent_;
    hub_.report();
    return std::nullopt;
  }

  publisher<ros::odometry> odom_;
  remote& hub_;
  const replay_options& chosen_;
  const rate_wish& wish_;
  const console& to_;
  ros::odometry message_ = blank_message();
  rt::time_point begin_{}; // of the lap
  std::uint64_t sent_ = 0;
};

exit_code play_poses(endpoint hub, const std::string& url, const std::vector<tum_pose>& poses,
                     const replay_options& o, const rate_wish& wish, const console& to) {
  auto odom = hub.advertise<ros::odometry>(o.topic, {.keep = keep::all, .depth = pose_queue_depth});
  if (!odom) {
    to.error("cannot publish on ", quoted(o.topic), ": ", odom.error().message());
    return exit_code_of(odom.error());
  }
  remote connection{hub, url, to};
  if (const auto end = connection.wait(o.timeout)) return *end;

  pose_player playing{std::move(odom).value(), connection, o, wish, to};
  const auto begin = rt::monotonic_clock::now();
  auto end = playing.play(poses);
  const status drained = hub.close(o.timeout.value_or(drain_time));
  const auto elapsed = rt::monotonic_clock::now() - begin;
  const std::uint64_t lost = lost_here(hub);
  if (!drained) to.error("at the end: ", drained.error().message());

  to.note("sent ", o.loop ? "" : joined(playing.sent(), " of "),
          counted(o.loop ? playing.sent() : poses.size(), "pose"), " in ", seconds_text(elapsed),
          lost == 0 ? std::string{} : joined(", dropped ", lost));
  const bool looped =
      o.loop && end == exit_code::interrupted && playing.sent() > 0; // the one way a loop ends
  if (end && !looped) return *end;
  return drained && lost == 0 ? exit_code::done : exit_code::lost;
}

} // namespace

exit_code replay_trajectory(const replay_options& o, const rate_wish& pace, const console& to) {
  if (o.topic.empty()) return usage_error("replay", "--topic NAME is missing");
  const topic_wishes& w = o.wishes;
  if (!o.from.empty() || !o.to.empty() || !w.only.empty() || !w.without.empty() || !w.remaps.empty() || o.ttl)
    return usage_error("replay",
                       "--from, --to, --topics, --exclude, --remap and --ttl are for recordings, not "
                       "for a trajectory");
  const tum_file file = read_tum_file(o.path());
  if (!file.fault.what.empty()) {
    const std::string line = file.fault.line == 0 ? "" : joined(":", file.fault.line);
    to.error(printable(o.path()), line, ": ", file.fault.what);
    return exit_code::failed;
  }
  if (o.loop && pose_times{file.poses, pace}.lap() <= rt::duration{0}) {
    return usage_error("replay", "a trajectory without duration has no pace to --loop at: give a --rate");
  }
  const auto bounds = limits_for("replay");
  if (!bounds) return exit_code::usage;
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("replay", o.at, {.limits = *bounds}, to, otherwise);
  if (!opened) return otherwise;
  return play_poses(std::move(opened->hub), opened->url, file.poses, o, pace, to);
}

} // namespace rowe::tools
