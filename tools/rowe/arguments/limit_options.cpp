// SPDX-License-Identifier: Apache-2.0
#include "limit_options.hpp"

#include <algorithm>

#include "../console.hpp"
#include "command_line.hpp"

namespace rowe::tools {

std::optional<limits> limits_for(std::string_view verb, std::size_t handle_bytes_min) {
  std::string why;
  auto surrounding = limits{}.with_environment(&why);
  if (!surrounding) {
    usage_error(verb, printable(why));
    return std::nullopt;
  }
  surrounding->handle_bytes = std::max(surrounding->handle_bytes, handle_bytes_min);
  return *surrounding;
}

} // namespace rowe::tools
