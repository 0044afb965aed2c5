// SPDX-License-Identifier: Apache-2.0
#include "topic_pattern.hpp"

#include <cstddef>

namespace rowe::tools {
namespace {

// Where to go on when a star takes one byte more.
struct star_place {
  std::size_t behind = 0; // the star, in the pattern; 0: there was none
  std::size_t taken = 0;  // of the name
};

} // namespace

bool topic_matches(std::string_view pattern, std::string_view name) noexcept {
  pattern = without_slash(pattern);
  name = without_slash(name);
  star_place within, across; // the last `*`, and the last `**`
  std::size_t p = 0, n = 0;
  while (p < pattern.size() || n < name.size()) {
    if (pattern.substr(p, 2) == "**") {
      across = {p += 2, n};
      within = {};
    } else if (p < pattern.size() && pattern[p] == '*') {
      within = {++p, n};
    } else if (p < pattern.size() && n < name.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (within.behind != 0 && within.taken < name.size() && name[within.taken] != '/') {
      p = within.behind;
      n = ++within.taken;
    } else if (across.behind != 0 && across.taken < name.size()) {
      p = across.behind;
      n = ++across.taken;
      within = {};
    } else {
      return false;
    }
  }
  return true;
}

} // namespace rowe::tools
