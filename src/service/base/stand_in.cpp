// SPDX-License-Identifier: Apache-2.0
#include "service/base/stand_in.hpp"

namespace rowe::service {

std::optional<stand_in_place> find_stand_in(std::string_view text, std::string_view stand_in) noexcept {
  const std::size_t mark = text.find(long_mark);
  if (mark == std::string_view::npos || text.find(long_mark, mark + 1) != std::string_view::npos)
    return std::nullopt;
  const std::size_t before = stand_in.find(long_mark);
  if (before > mark || text.substr(mark - before, stand_in.size()) != stand_in) return std::nullopt;
  return stand_in_place{mark - before, stand_in.size()};
}

} // namespace rowe::service
