// SPDX-License-Identifier: Apache-2.0
// One bridged topic each. A topic goes one way only: both ROS and rowe hand a publisher its own messages, so
// one that goes both ways would go round and round.
#pragma once
#include <ros/ros.h>

#include <atomic>
#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include <rowe/endpoint.hpp>
#include <rowe/json_text.hpp>

#include "definition.hpp"
#include "installed.hpp"
#include "raw_message.hpp"
#include "tally.hpp"

namespace rowe::ros1 {

// Between a socket and the other: how many values may come at once.
inline constexpr std::uint32_t topic_depth = 8;

// What roscpp tells of a message: subscribed to with `*`, so of whatever type its publisher says.
class topic_from_ros {
 public:
  struct description {
    std::string name;
    std::string type;
    bool latched = false;
  };

  topic_from_ros(const description& what, publisher<json_text> to, std::size_t bytes_max,
                 const installed_definitions& installed)
      : what_{what}, to_{std::move(to)}, bytes_max_{bytes_max}, installed_{installed} {}

  // Messages come from here on, on the thread of `queue`. False: roscpp refuses the name.
  bool subscribe(ros::NodeHandle& node, ros::CallbackQueue& queue);

  const description& what() const noexcept { return what_; }
  // Whether a publisher latches it, which only its first message says: then it is to be made anew.
  bool turned_out_latched() const noexcept { return latches_; }
  tally& counted() noexcept { return counted_; }

 private:
  void take(const ros::MessageEvent<raw_message const>& event);
  message_type_ptr type_of(const ros::M_string& header);

  description what_;
  publisher<json_text> to_;
  const std::size_t bytes_max_;
  const installed_definitions& installed_;
  std::map<std::string, message_type_ptr> types_; // by md5sum; publishers may differ
  std::string json_;
  std::atomic<bool> latches_{false};
  tally counted_;
  ros::Subscriber from_; // last: no message comes after it is gone
};

class topic_to_ros {
 public:
  topic_to_ros(std::string name, message_type_ptr type, subscriber<json_text> from, std::size_t bytes_max)
      : name_{std::move(name)}, type_{std::move(type)}, from_{std::move(from)}, bytes_max_{bytes_max} {}

  bool advertise(ros::NodeHandle& node);

  // Hands over what has come. False: there was nothing. One thread at a time.
  bool pump();

  const std::string& type() const noexcept { return type_->name; }
  tally& counted() noexcept { return counted_; }

 private:
  std::string name_;
  message_type_ptr type_;
  subscriber<json_text> from_;
  const std::size_t bytes_max_;
  ros::Publisher to_;
  tally counted_;
};

} // namespace rowe::ros1
