// SPDX-License-Identifier: Apache-2.0
#include "config/environment.hpp"

#include "config/keys.hpp"

namespace rowe::config {
namespace {

std::string upper(std::string_view text) {
  std::string made{text};
  for (char& c : made) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return made;
}

std::string prefix_of(std::string_view section) { return "ROWE_" + upper(section) + "_"; }

} // namespace

std::size_t find_variable(std::string_view variable) {
  std::size_t at = 0;
  for (; at < keys().size(); ++at) {
    const auto& one = keys()[at];
    if (variable == prefix_of(one.section) + upper(one.name)) break;
  }
  return at;
}

std::string unknown_variable(std::string_view variable) {
  // So limits were called once. Who still sets one must not believe that it holds.
  if (variable.starts_with("ROWE_LIMIT_"))
    return std::string{variable} + " sets nothing: limits are ROWE_LIMITS_...";
  std::string known;
  for (const auto& one : keys()) {
    const std::string prefix = prefix_of(one.section);
    if (!variable.starts_with(prefix)) continue;
    known.append(known.empty() ? "" : ", ").append(prefix).append(upper(one.name));
  }
  return known.empty() ? known : "there is no variable " + std::string{variable} + "; there are " + known;
}

} // namespace rowe::config
