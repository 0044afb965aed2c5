// SPDX-License-Identifier: Apache-2.0
// The values in a rosbridge envelope: which of the known members an object has, and the kinds of value that
// several members share. For rosbridge.cpp only; the texts are validated, nothing waits or allocates. What
// reads a value returns why it is refused, or nothing when it is right and `into` holds it.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "wire/rosbridge.hpp"
#include "json/reader.hpp"

namespace rowe::wire::rosbridge {

inline constexpr std::size_t word_bytes_max = 32; // no known member or word is longer

// The values of the known members of one object, by the place of their names in a table.
template <std::size_t Count>
struct members {
  std::array<json::value, Count> values;
  std::array<std::uint8_t, Count> times{}; // that each stands there: 0, 1, or 2 for more

  bool given(std::size_t which) const noexcept { return times[which] > 0; }
  // The first of the table that stands there twice.
  std::optional<std::size_t> twice() const noexcept {
    const auto found = std::find(times.begin(), times.end(), 2);
    if (found == times.end()) return std::nullopt;
    return static_cast<std::size_t>(found - times.begin());
  }
};

template <std::size_t Count>
members<Count> collect(std::string_view object, const std::array<std::string_view, Count>& names) noexcept {
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

inline refusal wrong_type(std::string_view member, const json::value& v, std::string_view expected) noexcept {
  return {.what = refusal::kind::wrong_type, .member = member, .value = v.raw, .expected = expected};
}

// Is the value a string that says the word, in either case?
bool is_word(const json::value& v, std::string_view word) noexcept;

// An integer from 0 to `most`.
std::optional<refusal> read_count(std::string_view member, const json::value& v, std::int64_t most,
                                  std::int64_t& into) noexcept;

// Seconds, or {"secs":…,"nsecs":…}, or "infinite"; in nanoseconds, lifespan_for_ever when it has no end or 64
// bits cannot hold it.
std::optional<refusal> read_duration(std::string_view member, const json::value& v,
                                     std::int64_t& into) noexcept;

// One of the words; `into` is its place.
std::optional<refusal> read_word(std::string_view member, const json::value& v,
                                 std::span<const std::string_view> words, std::string_view expected,
                                 std::size_t& into) noexcept;

// A text of at most `bytes_max` bytes once its escapes are resolved, for which `scratch` has room, without
// control characters.
std::optional<refusal> read_name(std::string_view member, const json::value& v, std::size_t bytes_max,
                                 std::span<char> scratch, std::string_view& into) noexcept;

} // namespace rowe::wire::rosbridge
