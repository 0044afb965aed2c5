// SPDX-License-Identifier: Apache-2.0
// What the ROS master knows. Nothing here waits for a master that is not there.
#pragma once
#include <map>
#include <optional>
#include <string>

namespace rowe::ros1 {

struct ros_graph {
  std::map<std::string, std::string> topics;   // that other nodes publish, and their types
  std::map<std::string, std::string> types;    // of all topics, also of those that are only subscribed to
  std::map<std::string, std::string> services; // of other nodes, and where they are ("rosrpc://HOST:PORT")
  int master = 0;                              // its process: another one has forgotten us
};

// Nothing: the master does not answer.
std::optional<ros_graph> look_at_ros();

// The type of a service, from its provider. Nothing: it did not say within 2 s.
std::optional<std::string> type_of_service(const std::string& name, const std::string& uri);

} // namespace rowe::ros1
