// SPDX-License-Identifier: Apache-2.0
// What is bridged at the moment, and what should be: compared once a second, by the main thread, since
// neither ROS nor rosbridge says when something is new. Messages pass on other threads: those from ROS on one
// of roscpp's, those to ROS on one of ours, and each service has its own.
#pragma once
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <atomic>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../rowe/console.hpp"
#include "installed.hpp"
#include "master.hpp"
#include "services.hpp"
#include "topics.hpp"
#include "wanted.hpp"

namespace rowe::ros1 {

inline constexpr std::size_t topics_max = 64;
inline constexpr std::size_t services_max = 32;

struct bridge_options {
  wanted_names topics_from_ros;
  wanted_names topics_to_ros;
  wanted_names services_from_ros;
  wanted_names services_to_ros;
  wanted_names except;
  bool stop = true;
  rt::duration timeout = std::chrono::seconds{10}; // of a call from ROS
  std::size_t bytes_max = 0;                       // of one message, either way
};

class bridge {
 public:
  bridge(endpoint& hub, const bridge_options& how, const installed_definitions& installed,
         const tools::console& to);
  ~bridge();

  // Adds what is new, and drops what is gone.
  void follow(const ros_graph& graph);
  // All of it ends: another master has forgotten us.
  void forget();
  // Says what was dropped since the last time, and why.
  void report_losses();
  // Says what passed, and what did not, of each.
  void summarise();

 private:
  // What was last said of losses, and when they are reported again.
  struct reported {
    std::uint64_t dropped = 0;
    rt::time_point again = {};
  };
  template <class Row>
  using rows = std::map<std::string, std::unique_ptr<Row>>;

  void follow_topics_from_ros(const ros_graph& graph);
  void follow_topics_to_ros(const ros_graph& graph);
  void follow_services_from_ros(const ros_graph& graph);
  void follow_services_to_ros(const ros_graph& graph);
  void add_from_ros(const topic_from_ros::description& what);
  void add_to_ros(const std::string& name, const std::string& type);
  void add_service_from_ros(const std::string& name, const std::string& uri);
  void add_service_to_ros(const std::string& name, const std::string& type);

  void retire(std::unique_ptr<service_from_ros> row);
  bool is_wanted(const wanted_names& names, const std::string& name) const;
  bool has_room(std::size_t used, std::size_t most, const std::string& name);
  void cannot(const std::string& name, const std::string& why);
  void pump();
  template <class Each>
  void for_each_tally(const Each& each);

  // Asks a service of the robot's endpoint; an empty text: no answer.
  std::string ask(caller<json_text, json_text>& of, std::string_view request);

  endpoint& hub_;
  const bridge_options& how_;
  const installed_definitions& installed_;
  const tools::console& to_;
  ros::NodeHandle node_;
  ros::CallbackQueue queue_; // of messages from ROS
  ros::AsyncSpinner spinner_{1, &queue_};
  caller<json_text, json_text> ask_topics_;
  caller<json_text, json_text> ask_services_;
  caller<json_text, json_text> ask_type_;

  rows<topic_from_ros> from_ros_;
  std::mutex pumping_; // guards to_ros_
  rows<topic_to_ros> to_ros_;
  rows<service_from_ros> services_from_ros_;
  std::vector<std::unique_ptr<service_from_ros>> retired_; // gone, but for a call that has not returned
  rows<service_to_ros> services_to_ros_;
  std::unique_ptr<stop_from_ros> stop_;
  std::map<std::string, std::string> failures_; // said already
  std::map<std::string, reported> reported_;
  std::atomic<bool> over_{false};
  std::thread pump_thread_; // last
};

} // namespace rowe::ros1
