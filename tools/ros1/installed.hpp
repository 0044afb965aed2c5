// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "definition.hpp"

namespace rowe::ros1 {

// The definitions that are on this machine: FOLDER/package/msg/Name.msg and FOLDER/package/srv/Name.srv. A
// folder may also be the package itself.
class installed_definitions {
 public:
  // The user's folders, then those of $ROS_PACKAGE_PATH, /opt/ros/*/share and /usr/share.
  explicit installed_definitions(std::vector<std::string> first);

  message_type_ptr message(const std::string& type, std::string& why) const;
  std::optional<service_type> service(const std::string& type, std::string& why) const;

 private:
  std::optional<std::string> text(const std::string& type, const std::string& kind) const;
  definition_source source() const;

  std::vector<std::string> folders_;
};

} // namespace rowe::ros1
