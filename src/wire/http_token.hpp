// SPDX-License-Identifier: Apache-2.0
// Where a request may have a token, and what of a request may be quoted, in an answer or an event: nothing
// that may have one. For http_request.cpp only. Pure functions.
#pragma once
#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>

#include "wire/ascii.hpp"

namespace rowe::wire {

// Whether `value`, a part of the header, stands in a line that may have a token: one that names it, or that
// continues the line before it, which is malformed.
inline bool may_have_token(std::string_view header, std::string_view value) noexcept {
  const std::less<const char*> before;
  const char* const end = header.data() + header.size();
  if (before(value.data(), header.data()) || before(end, value.data())) return false;
  const auto at = static_cast<std::size_t>(value.data() - header.data());
  const std::size_t begin = at == 0 ? 0 : header.rfind('\n', at - 1) + 1; // npos + 1 is 0
  const std::string_view line = header.substr(begin, header.find('\n', at) - begin);
  return line.starts_with(' ') || line.starts_with('\t') || contains_ignoring_case(line, "token") ||
         contains_ignoring_case(line, "cookie") || contains_ignoring_case(line, "authorization") ||
         contains_ignoring_case(line, "bearer");
}

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
