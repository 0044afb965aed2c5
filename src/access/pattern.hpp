// SPDX-License-Identifier: Apache-2.0
// Matches names of topics and services. Pure; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <string_view>

#include "wire/codec/own_names.hpp"

namespace rowe::access {

// Whether the pattern describes the name: `*` stands for any text without a slash, `**` for any text. After a
// mismatch the last `*` takes one byte more, and if it cannot, the last `**` does. What stands before the
// last `**` has matched as early as it can, so it is never looked at again. Time: the product of the lengths
// at most, as in the classical algorithm for one kind of star, for each byte that a `**` takes.
constexpr bool matches(std::string_view pattern, std::string_view name) noexcept {
  constexpr std::size_t nowhere = std::string_view::npos;
  struct star {
    std::size_t behind = nowhere; // the star, in the pattern
    std::size_t takes_to = 0;     // in the name
  };
  pattern = wire::without_slash(pattern); // names are the same with and without it
  name = wire::without_slash(name);
  star one, any;
  std::size_t p = 0, n = 0;
  while (n < name.size() || p < pattern.size()) {
    if (pattern.substr(p).starts_with("**")) {
      any = {p += 2, n};
      one = {};
    } else if (p < pattern.size() && pattern[p] == '*') {
      one = {++p, n};
    } else if (p < pattern.size() && n < name.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (one.behind != nowhere && one.takes_to < name.size() && name[one.takes_to] != '/') {
      p = one.behind;
      n = ++one.takes_to;
    } else if (any.behind != nowhere && any.takes_to < name.size()) {
      p = any.behind;
      n = ++any.takes_to;
      one = {};
    } else {
      return false;
    }
  }
  return true;
}

} // namespace rowe::access
