// SPDX-License-Identifier: Apache-2.0
// The token in a URL. For http_request.cpp only. Pure functions.
#pragma once
#include <algorithm>
#include <optional>
#include <string_view>

namespace rowe::wire {

// Of `a=1&token=T`; empty if there is none. Nothing if there are two: who wrote the second may be another.
inline std::optional<std::string_view> token_in_query(std::string_view target) noexcept {
  constexpr std::string_view name = "token=";
  std::string_view found;
  target.remove_prefix(std::min(target.find('?'), target.size()));
  while (!target.empty()) {
    target.remove_prefix(1);
    const std::string_view pair = target.substr(0, target.find('&'));
    if (pair.starts_with(name)) {
      if (!found.empty()) return std::nullopt;
      found = pair.substr(name.size());
    }
    target.remove_prefix(pair.size());
  }
  return found;
}

} // namespace rowe::wire
