// SPDX-License-Identifier: Apache-2.0
// Where a request may have a token, and what of a request may be quoted, in an answer or an event: nothing
// that may have one. For http_request.cpp only. Pure functions.
#pragma once
#include <algorithm>
#include <string_view>

#include "wire/ascii.hpp"

namespace rowe::wire {

inline std::string_view without_query(std::string_view target) noexcept {
  return target.substr(0, target.find('?'));
}

// What of a malformed line may be quoted: of one that may have a token, only its first word.
inline std::string_view quotable(std::string_view line) noexcept {
  const bool secret = contains_ignoring_case(line, "token") || contains_ignoring_case(line, "auth");
  return secret ? line.substr(0, line.find_first_of("?: \t")) : line;
}

// Of `a=1&token=T`; empty if there is none.
inline std::string_view token_in_query(std::string_view target) noexcept {
  constexpr std::string_view name = "token=";
  target.remove_prefix(std::min(target.find('?'), target.size()));
  while (!target.empty()) {
    target.remove_prefix(1);
    const std::string_view pair = target.substr(0, target.find('&'));
    if (pair.starts_with(name)) return pair.substr(name.size());
    target.remove_prefix(pair.size());
  }
  return {};
}

} // namespace rowe::wire
