// SPDX-License-Identifier: Apache-2.0
// One bridged service each, with a thread of its own: a call that never returns keeps nobody but its own
// service. ROS has no time-outs, so the thread of a service that ROS provides may be kept for ever.
#pragma once
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <rowe/endpoint.hpp>
#include <rowe/json_text.hpp>

#include "definition.hpp"
#include "tally.hpp"

namespace rowe::ros1 {

inline constexpr std::uint32_t service_depth = 4; // calls that wait for one service

class service_from_ros {
 public:
  service_from_ros(std::string name, service_type type, responder<json_text, json_text> to,
                   std::size_t bytes_max);
  // Waits for the call that is in flight, unless roscpp is shut down.
  ~service_from_ros();

  const std::string& type() const noexcept { return type_.name; }
  tally& counted() noexcept { return counted_; }

  // Takes no more calls. Once it has ended, its destructor does not wait.
  void end() noexcept { over_ = true; }
  bool has_ended() const noexcept { return ended_; }

 private:
  void answer();
  std::string answer_to(json_value request, std::string& json);

  const std::string name_;
  const service_type type_;
  responder<json_text, json_text> to_;
  const std::size_t bytes_max_;
  tally counted_;
  std::atomic<bool> ended_{false};
  std::atomic<bool> over_{false};
  std::thread thread_; // last: it begins when all the rest is there
};

// Answers calls from ROS by `answer`, on a thread of its own.
class ros_service {
 public:
  // What a call is answered with: bytes of the response, or nothing, and why.
  struct answer {
    bool ok = false;
    std::string bytes;
    std::string why;
  };
  using handler = std::function<answer(const std::string& caller, const std::string& request)>;

  // False: roscpp refuses it. `is_open` says.
  ros_service(ros::NodeHandle& node, const std::string& name, const service_type& type, handler how);
  ~ros_service();
  bool is_open() const noexcept { return static_cast<bool>(server_); }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
  ros::ServiceServer server_;
};

class service_to_ros {
 public:
  service_to_ros(ros::NodeHandle& node, const std::string& name, service_type type,
                 caller<json_text, json_text> from, std::size_t bytes_max, rt::duration timeout);

  bool is_open() const noexcept { return server_.is_open(); }
  tally& counted() noexcept { return counted_; }

 private:
  ros_service::answer ask(const std::string& request);

  const service_type type_;
  caller<json_text, json_text> from_;
  const std::size_t bytes_max_;
  const rt::duration timeout_;
  tally counted_;
  ros_service server_; // last
};

// `/rowe/stop` in ROS, as std_srvs/Trigger: stops the robot at the other end, and says whether its loops have
// acknowledged. It needs no definitions, no other service and no topic.
class stop_from_ros {
 public:
  stop_from_ros(ros::NodeHandle& node, caller<json_text, json_text> stop);
  bool is_open() const noexcept { return server_.is_open(); }
  tally& counted() noexcept { return counted_; }

 private:
  ros_service::answer stop(const std::string& who);

  caller<json_text, json_text> stop_;
  tally counted_;
  ros_service server_; // last
};

} // namespace rowe::ros1
