// SPDX-License-Identifier: Apache-2.0
#include "service/stand_in.hpp"

#include <array>
#include <span>

namespace rowe::service {

std::optional<stand_in_place> find_stand_in(std::string_view text, std::string_view stand_in) noexcept {
  const std::size_t mark = text.find(long_mark);
  if (mark == std::string_view::npos || text.find(long_mark, mark + 1) != std::string_view::npos)
    return std::nullopt;
  const std::string_view inside = stand_in.substr(1, stand_in.size() - 2);
  for (const std::string_view one : {stand_in, inside}) {
    const std::size_t before = one.find(long_mark);
    if (before <= mark && text.substr(mark - before, one.size()) == one)
      return stand_in_place{mark - before, one.size(), one.data() != stand_in.data()};
  }
  return std::nullopt;
}

bool strip_brackets(chunk_store& chunks, const long_value& value) noexcept {
  const std::size_t bytes = chunks.bytes(value.text);
  if (bytes < 3) return false;
  std::array<char, 2> ends;
  const auto into = std::as_writable_bytes(std::span{ends});
  chunk_store::place from;
  chunks.copy(value.text, 0, from, into.first(1));
  chunks.copy(value.text, bytes - 1, from, into.last(1));
  if (ends[0] != value.stand_in.front() || ends[1] != value.stand_in.back()) return false;
  chunks.cut(value.text, 1, bytes - 2);
  return true;
}

} // namespace rowe::service
