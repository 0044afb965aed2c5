// SPDX-License-Identifier: Apache-2.0
// Finds the members of an object that a codec knows. For the codecs in this folder; the texts are validated,
// nothing waits or allocates.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "json/reader.hpp"

namespace rowe::wire {

inline constexpr std::size_t word_bytes_max = 32; // no known member or word is longer

// The values of the known members of one object, by the place of their names in a table.
template <std::size_t Count>
struct members {
  std::array<json::value, Count> values;
  std::array<std::uint8_t, Count> times{}; // that each stands there: 0, 1, or 2 for more

  bool given(std::size_t which) const noexcept { return times[which] > 0; }
  // The first member of the table that occurs twice.
  std::optional<std::size_t> twice() const noexcept {
    const auto found = std::find(times.begin(), times.end(), 2);
    if (found == times.end()) return std::nullopt;
    return static_cast<std::size_t>(found - times.begin());
  }
};

template <std::size_t Count>
inline members<Count> collect(const json::document& object,
                              const std::array<std::string_view, Count>& names) noexcept {
  members<Count> found;
  json::object_walk walk{object};
  for (json::member m; walk.next(m);) {
    std::array<char, word_bytes_max> scratch;
    const auto plain = json::unescape(m.name_raw, scratch);
    if (!plain) continue; // longer than any known name
    const auto index =
        static_cast<std::size_t>(std::find(names.begin(), names.end(), *plain) - names.begin());
    if (index == Count) continue;
    found.values[index] = m.what;
    found.times[index] = found.times[index] == 0 ? 1 : 2;
  }
  return found;
}

// For texts that are no JSON, so one can only guess: the text behind `name` (with its quotes) and a colon,
// without white space; nothing if `name` is not there. Searches from `from` on, and moves `from` behind it.
inline std::optional<std::string_view> behind_name(std::string_view text, std::string_view name,
                                                   std::size_t& from) noexcept {
  constexpr std::string_view space = " \t\r\n";
  while ((from = text.find(name, from)) != std::string_view::npos) {
    from += name.size();
    const std::size_t colon = text.find_first_not_of(space, from);
    if (colon == std::string_view::npos || text[colon] != ':') continue;
    const std::size_t value = text.find_first_not_of(space, colon + 1);
    return value == std::string_view::npos ? std::string_view{} : text.substr(value);
  }
  return std::nullopt;
}

// Names of topics, services and types must not have control characters.
inline bool has_control_characters(std::string_view text) noexcept {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

} // namespace rowe::wire
