// SPDX-License-Identifier: Apache-2.0
// Finds the members of an object that a codec knows. For the codecs in this folder; the texts are validated,
// nothing waits or allocates.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "wire/codec/refusal.hpp"
#include "wire/text/word_table.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire {

inline constexpr std::size_t word_bytes_max = 32; // no known member or word is longer

// The place in the table of a word that a JSON text has between quotes; Count if it is not there. A known
// word has no backslash, so escapes are resolved only in a text that is none.
template <std::size_t Count>
inline std::size_t find_escaped(const word_table<Count>& words, std::string_view escaped) noexcept {
  const std::size_t place = words.find(escaped);
  if (place != Count || escaped.find('\\') == std::string_view::npos) return place;
  std::array<char, word_bytes_max> scratch;
  const auto plain = json::unescape(escaped, scratch);
  return plain ? words.find(*plain) : Count; // longer than any known word
}

// The values of the known members of one object, by the place of their names in a table.
template <std::size_t Count>
struct members {
  static_assert(Count <= 32);
  std::array<json::value, Count> values;
  std::uint32_t seen = 0;     // bit i: member i is there
  std::uint32_t repeated = 0; // bit i: it is there more than once

  bool given(std::size_t which) const noexcept { return (seen >> which & 1) != 0; }
  bool repeats(std::size_t which) const noexcept { return (repeated >> which & 1) != 0; }
  // The first member of the table that occurs twice.
  std::optional<std::size_t> twice() const noexcept {
    if (repeated == 0) return std::nullopt;
    return static_cast<std::size_t>(std::countr_zero(repeated));
  }
};

template <std::size_t Count>
inline members<Count> collect(const json::document& object, const word_table<Count>& names) noexcept {
  members<Count> found;
  json::object_walk walk{object};
  for (json::member m; walk.next(m);) {
    const std::size_t which = find_escaped(names, m.name_raw);
    if (which == Count) continue;
    const std::uint32_t bit = std::uint32_t{1} << which;
    found.values[which] = m.what;
    found.repeated |= found.seen & bit;
    found.seen |= bit;
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

// What a member may not be.
inline refusal wrong_type(std::string_view member, const json::value& v, std::string_view expected) noexcept {
  return {.what = refusal::kind::wrong_type, .member = member, .value = v.raw, .expected = expected};
}
inline refusal too_long(std::string_view member, std::size_t bytes, std::size_t limit) noexcept {
  return {.what = refusal::kind::too_long,
          .member = member,
          .bytes = bytes,
          .limit = static_cast<std::int64_t>(limit)};
}
inline refusal negative(std::string_view member, const json::value& v) noexcept {
  return {.what = refusal::kind::negative, .member = member, .value = v.raw};
}
inline refusal bad_characters(std::string_view member, const json::value& v) noexcept {
  return {.what = refusal::kind::bad_characters, .member = member, .value = v.raw};
}

// Names of topics, services and types must not have control characters.
inline bool has_control_characters(std::string_view text) noexcept {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

} // namespace rowe::wire
