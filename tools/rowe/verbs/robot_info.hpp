// SPDX-License-Identifier: Apache-2.0
// rowe info URL NAME: what a topic, a service or an action of a robot is. (info.cpp has that of recordings.)
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "../console.hpp"
#include "../network/remote.hpp"

namespace rowe::tools {

struct robot_info_options {
  remote_place at;
  std::vector<std::string> names;
  std::optional<rt::duration> timeout;
  bool json = false;
};

exit_code info_of_robot(const robot_info_options& chosen, const console& to);

} // namespace rowe::tools
