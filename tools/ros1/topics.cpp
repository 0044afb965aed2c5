// SPDX-License-Identifier: Apache-2.0
#include "topics.hpp"

#include <ros/callback_queue.h>

#include "../rowe/console.hpp"
#include "convert.hpp"

namespace rowe::ros1 {
namespace {

using tools::joined;
using tools::printable;

constexpr std::size_t types_of_topic_max = 16; // publishers of one topic whose definitions differ

std::string header_of(const ros::M_string& header, const char* key) {
  const auto found = header.find(key);
  return found == header.end() ? std::string{} : found->second;
}

} // namespace

bool topic_from_ros::subscribe(ros::NodeHandle& node, ros::CallbackQueue& queue) {
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const ros::MessageEvent<raw_message const>&>(
      what_.name, topic_depth, [this](const ros::MessageEvent<raw_message const>& event) { take(event); });
  options.callback_queue = &queue;
  options.transport_hints = ros::TransportHints{}.tcpNoDelay();
  from_ = node.subscribe(options);
  return static_cast<bool>(from_);
}

void topic_from_ros::take(const ros::MessageEvent<raw_message const>& event) {
  const ros::M_string& header = event.getConnectionHeader();
  if (header_of(header, "callerid") == ros::this_node::getName()) return;
  if (header_of(header, "latching") == "1" && !what_.latched) latches_ = true;
  const message_type_ptr type = type_of(header);
  if (!type) {
    ++counted_.wrong;
    return;
  }
  json_.clear();
  switch (to_json(*type, event.getConstMessage()->bytes, json_, bytes_max_)) {
  case converted::done: break;
  case converted::wrong:
    ++counted_.wrong;
    counted_.because(
        joined("a message of ", event.getConstMessage()->bytes.size(), " bytes is no ", type->name));
    return;
  case converted::too_big:
    ++counted_.too_big;
    counted_.because(joined("a message of ", event.getConstMessage()->bytes.size(), " bytes is longer than ",
                            bytes_max_, " bytes of JSON"));
    return;
  }
  const status done = to_.publish(json_);
  if (done) {
    ++counted_.passed;
  } else if (done.code() == errc::no_peer) {
    ++counted_.no_peer;
    counted_.because("the robot's endpoint is not connected");
  } else {
    ++counted_.full;
    counted_.because(done.error().message());
  }
}

// The publisher's own definition; where it sends none, the one that is installed here.
message_type_ptr topic_from_ros::type_of(const ros::M_string& header) {
  const std::string md5 = header_of(header, "md5sum");
  if (const auto known = types_.find(md5); known != types_.end()) return known->second;
  if (types_.size() >= types_of_topic_max) types_.clear();
  const std::string name = plain_type_name(header_of(header, "type"));
  const std::string definition = header_of(header, "message_definition");
  std::string why;
  message_type_ptr type;
  if (name.empty()) {
    why = "its publisher names no type";
  } else if (definition.empty()) {
    type = installed_.message(name, why);
  } else {
    type = read_message(name, sections_of(name, definition), why);
  }
  if (!type) counted_.because(joined("the definition of ", name, " cannot be read: ", printable(why)));
  return types_[md5] = type;
}

bool topic_to_ros::advertise(ros::NodeHandle& node) {
  ros::AdvertiseOptions options{name_, topic_depth, type_->md5, type_->name, whole_text(*type_)};
  to_ = node.advertise(options);
  return static_cast<bool>(to_);
}

bool topic_to_ros::pump() {
  bool any = false;
  for (std::uint32_t i = 0; i < topic_depth; ++i) {
    const auto taken = from_.try_take();
    if (!taken) break;
    any = true;
    raw_message message;
    std::string why;
    switch (from_json(*type_, taken->json(), message.bytes, bytes_max_, why)) {
    case converted::done:
      to_.publish(message);
      ++counted_.passed;
      break;
    case converted::too_big:
      ++counted_.too_big;
      counted_.because(joined("a message is longer than ", bytes_max_, " bytes of ROS"));
      break;
    case converted::wrong:
      ++counted_.wrong;
      counted_.because(why);
      break;
    }
  }
  return any;
}

} // namespace rowe::ros1
