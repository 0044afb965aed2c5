// SPDX-License-Identifier: Apache-2.0
// A TUM trajectory as recorded messages: each pose as the nav_msgs/Odometry that `rowe replay` publishes.
#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>

#include "../console.hpp"
#include "../text/tum.hpp"
#include "own_topics.hpp"
#include "recorded_messages.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t pose_bytes_max = 512;

void append_number(double number, std::string& to) {
  std::array<char, 32> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), number);
  to.append(text.data(), written.ptr);
}

class kept_poses final : public recorded_messages {
 public:
  kept_poses(std::vector<tum_pose> poses, const std::string& topic) : poses_{std::move(poses)}, topics_(1) {
    topics_[0].name = topic;
    topics_[0].type = "nav_msgs/Odometry";
    topics_[0].encoding = json_encoding;
    topics_[0].messages = poses_.size();
  }

  const std::vector<recorded_topic>& topics() const noexcept override { return topics_; }
  std::uint64_t messages() const noexcept override { return poses_.size(); }
  std::int64_t begin_ns() const noexcept override { return poses_.front().time_ns; }
  std::int64_t end_ns() const noexcept override { return poses_.back().time_ns; }
  std::size_t message_bytes_max() const override { return pose_bytes_max; }

  void select(std::int64_t from_ns, std::int64_t until_ns, const std::vector<std::size_t>&) override {
    until_ns_ = until_ns;
    const auto first = std::find_if(poses_.begin(), poses_.end(),
                                    [&](const tum_pose& one) { return one.time_ns >= from_ns; });
    at_ = static_cast<std::size_t>(std::distance(poses_.begin(), first));
  }
  std::optional<kept_message> next() override {
    if (at_ == poses_.size() || poses_[at_].time_ns >= until_ns_) return std::nullopt;
    const tum_pose& pose = poses_[at_++];
    body_ = R"({"pose":{"pose":{"position":{)";
    append_members(pose.position, body_);
    body_ += R"(},"orientation":{)";
    append_members(pose.orientation, body_);
    body_ += "}}}}";
    return kept_message{0, pose.time_ns, body_};
  }
  std::vector<std::string> faults() override { return {}; }

 private:
  template <std::size_t count>
  static void append_members(const std::array<double, count>& numbers, std::string& to) {
    constexpr std::string_view names = "xyzw";
    for (std::size_t i = 0; i < count; ++i) {
      to.append(i == 0 ? "\"" : ",\"").append(names.substr(i, 1)).append("\":");
      append_number(numbers[i], to);
    }
  }

  std::vector<tum_pose> poses_;
  std::vector<recorded_topic> topics_;
  std::int64_t until_ns_ = 0;
  std::size_t at_ = 0;
  std::string body_;
};

} // namespace

std::unique_ptr<recorded_messages> open_trajectory(const std::string& path, const std::string& topic,
                                                   std::string& why) {
  tum_file file = read_tum_file(path);
  if (!file.fault.what.empty()) {
    const std::string line = file.fault.line == 0 ? "" : joined(":", file.fault.line);
    why = joined(printable(path), line, ": ", file.fault.what);
    return nullptr;
  }
  return std::make_unique<kept_poses>(std::move(file.poses), topic);
}

} // namespace rowe::tools
