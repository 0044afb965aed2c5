// SPDX-License-Identifier: Apache-2.0
#include "limit_options.hpp"

#include <algorithm>

#include "../console.hpp"
#include "command_line.hpp"

namespace rowe::tools {
namespace {

// Sets one limit from NAME=VALUE; otherwise says what is wrong.
std::string set_limit(limits& in, std::string_view asked) {
  const auto equals = asked.find('=');
  if (equals == asked.npos)
    return joined("--limit needs NAME=VALUE such as topics_max=256, not ", quoted(asked));
  const std::string_view name = asked.substr(0, equals);
  const auto known = limits::names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    const std::string_view meant = nearest(name, known);
    if (!meant.empty())
      return joined("--limit: there is no limit ", quoted(name), "; did you mean ", meant, "?");
  }
  std::string why;
  if (in.set(name, asked.substr(equals + 1), &why)) return {};
  return joined("--limit: ", printable(why));
}

} // namespace

std::optional<limits> limits_for(std::string_view verb, std::size_t lane_bytes_min,
                                 std::span<const std::string> chosen) {
  std::string why;
  const auto surrounding = limits{}.with_environment(&why);
  if (!surrounding) {
    usage_error(verb, printable(why));
    return std::nullopt;
  }
  limits made = *surrounding;
  for (const std::string& one : chosen) {
    if (const std::string wrong = set_limit(made, one); !wrong.empty()) {
      usage_error(verb, wrong);
      return std::nullopt;
    }
  }
  made.lane_bytes = std::max(made.lane_bytes, lane_bytes_min);
  return made;
}

} // namespace rowe::tools
