// SPDX-License-Identifier: Apache-2.0
#include "decoders.hpp"

#include <memory>
#include <string>
#include <utility>

#include <rowe/ros_type.hpp>

#include "../text/json_values.hpp"
#include "own_topics.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t decoded_bytes_max = 64 << 20; // as long as any message may be

std::optional<std::string_view> as_it_is(std::string_view json) {
  const auto read = json_value::parse(json);
  if (!read || read->kind() != json_kind::object) return std::nullopt;
  return json;
}

// Messages of ROS, by the definition that the recording carries.
class ros_messages {
 public:
  ros_messages(ros_type type, ros_encoding encoding) : type_{std::move(type)}, encoding_{encoding} {}

  std::optional<std::string_view> json_of(std::string_view data) {
    if (!type_.to_json(encoding_, data, json_, decoded_bytes_max)) return std::nullopt;
    return json_;
  }

 private:
  const ros_type type_;
  const ros_encoding encoding_;
  std::string json_;
};

message_decoder of_ros(const recorded_topic& topic, ros_version version, ros_encoding encoding) {
  auto type = ros_type::parse(topic.type, topic.schema, version);
  if (!type) return {};
  return [messages = std::make_shared<ros_messages>(std::move(*type), encoding)](std::string_view data) {
    return messages->json_of(data);
  };
}

} // namespace

message_decoder decoder_for(const recorded_topic& topic) {
  if (topic.encoding == json_encoding) return as_it_is;
  if (topic.encoding == "ros1" && topic.schema_encoding == "ros1msg")
    return of_ros(topic, ros_version::ros1, ros_encoding::ros1);
  if (topic.encoding == "cdr" && topic.schema_encoding == "ros2msg")
    return of_ros(topic, ros_version::ros2, ros_encoding::cdr);
  return {};
}

} // namespace rowe::tools
