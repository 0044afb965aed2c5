// SPDX-License-Identifier: Apache-2.0
// What a pattern of names means, written as it is said. Slow: for short texts.
#pragma once
#include <cstddef>
#include <string_view>

namespace access_meaning {

// Both without their first slash.
inline bool means(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern.starts_with("**")) {
    for (std::size_t taken = 0; taken <= name.size(); ++taken)
      if (means(pattern.substr(2), name.substr(taken))) return true;
    return false;
  }
  if (pattern.front() == '*') {
    for (std::size_t taken = 0; taken <= name.size(); ++taken) {
      if (means(pattern.substr(1), name.substr(taken))) return true;
      if (taken < name.size() && name[taken] == '/') return false;
    }
    return false;
  }
  return !name.empty() && pattern.front() == name.front() && means(pattern.substr(1), name.substr(1));
}

} // namespace access_meaning
