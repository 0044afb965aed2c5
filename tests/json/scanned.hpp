// SPDX-License-Identifier: Apache-2.0
// What json::scanner says of a text that comes in pieces.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string_view>

#include "json/reading/reader.hpp"
#include "json/reading/scanner.hpp"

namespace rowe::tests {

// Feeds `text` to the scanner, each piece from exactly so many bytes of the heap, for the address sanitizer
// to watch. `next()` says how long a piece is, at least 1.
template <class Next>
json::scanner scanned(std::string_view text, std::size_t depth_max, Next next) {
  json::scanner s{depth_max};
  while (!text.empty()) {
    const std::size_t bytes = std::min<std::size_t>(next(), text.size());
    const auto piece = std::make_unique<char[]>(bytes);
    std::memcpy(piece.get(), text.data(), bytes);
    if (!s.feed({piece.get(), bytes})) break;
    text.remove_prefix(bytes);
  }
  s.finish();
  return s;
}

// The first members that a walk through a valid text finds are those that the scanner has noted.
inline bool notes_what_is_walked(const json::scanner& s, std::string_view text) {
  json::object_walk walk{text};
  json::member m;
  const auto is_at = [text](std::string_view part, const json::stretch& place) {
    return part.data() == text.data() + place.at && part.size() == place.bytes;
  };
  for (const json::placed_member& placed : s.members()) {
    if (!walk.next(m) || !is_at(m.name_raw, placed.name) || !is_at(m.what.raw, placed.raw) ||
        m.what.type != placed.type)
      return false;
  }
  return walk.next(m) == s.has_more_members();
}

} // namespace rowe::tests
