// SPDX-License-Identifier: Apache-2.0
#include "wire/rosbridge/rosbridge_values.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "wire/codec/members.hpp"
#include "wire/rosbridge/rosbridge_operations.hpp"
#include "wire/text/ascii.hpp"

namespace rowe::wire::rosbridge {
namespace {

constexpr std::int64_t most_nanoseconds = std::numeric_limits<std::int64_t>::max();

std::int64_t nanoseconds_of(double seconds) noexcept {
  const double ns = seconds * 1e9;
  constexpr double bound = 9.2e18; // a little below what 64 bits hold: 291 years
  return ns < bound ? static_cast<std::int64_t>(ns + 0.5) : unlimited;
}

std::int64_t nanoseconds_of(std::int64_t seconds, std::int64_t nanoseconds) noexcept {
  constexpr std::int64_t second = 1'000'000'000;
  if (seconds > most_nanoseconds / second || nanoseconds > most_nanoseconds - seconds * second) {
    return unlimited;
  }
  return seconds * second + nanoseconds;
}

// Written as an integer, however large.
bool is_integer(const json::value& v) noexcept {
  return v.type == json::kind::number && v.raw.find_first_of(".eE") == std::string_view::npos;
}

// Neither escapes nor control characters, as in nearly every name.
bool is_plain(std::string_view escaped) noexcept {
  return std::all_of(escaped.begin(), escaped.end(),
                     [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f && c != '\\'; });
}

} // namespace

bool is_word(const json::value& v, std::string_view word) noexcept {
  std::array<char, word_bytes_max> scratch;
  const auto text = json::to_string(v, scratch);
  return text && equal_ignoring_case(*text, word);
}

std::optional<refusal> read_count(std::string_view member, const json::value& v, std::int64_t most,
                                  std::int64_t& into) noexcept {
  if (!is_integer(v)) return wrong_type(member, v, "an integer");
  if (v.raw.starts_with('-') && v.raw != "-0") return negative(member, v);
  const auto number = v.raw == "-0" ? std::optional<std::int64_t>{0} : json::to_integer(v);
  if (!number || *number > most) {
    return refusal{.what = refusal::kind::too_large, .member = member, .value = v.raw, .limit = most};
  }
  into = *number;
  return std::nullopt;
}

std::optional<refusal> read_throttle(const json::value& v, std::int64_t& into) noexcept {
  if (v.type == json::kind::number && v.raw.starts_with('-')) return std::nullopt;
  return read_count("throttle_rate", v, milliseconds_max, into);
}

std::optional<refusal> read_at_least(std::string_view member, const json::value& v, std::int64_t least,
                                     std::uint32_t& into) noexcept {
  std::int64_t number = 0;
  const auto wrong = read_count(member, v, std::numeric_limits<std::int64_t>::max(), number);
  if (wrong && wrong->what != refusal::kind::negative) return wrong;
  if (wrong || number < least)
    return refusal{.what = refusal::kind::too_small, .member = member, .value = v.raw, .limit = least};
  into = static_cast<std::uint32_t>(std::min<std::int64_t>(number, UINT32_MAX));
  return std::nullopt;
}

std::optional<refusal> read_fragment(const json::document& text, request& into) noexcept {
  static constexpr word_table names{"data", "num", "total"};
  const auto found = collect(text, names);
  for (std::size_t i = 0; i != names.size(); ++i) {
    const auto what = found.repeats(i) ? refusal::kind::twice : refusal::kind::missing;
    if (found.repeats(i) || !found.given(i)) return refusal{.what = what, .member = names[i]};
  }
  const auto& [data, num, total] = found.values;
  if (data.type != json::kind::string) return wrong_type("data", data, "a string");
  into.body_raw = data.raw;
  std::int64_t number = 0;
  if (const auto wrong = read_count("num", num, UINT32_MAX, number)) return wrong;
  into.fragment_number = static_cast<std::uint32_t>(number);
  const auto count = json::to_double(total);
  if (!count) return wrong_type("total", total, "a number");
  if (*count < 1)
    return refusal{.what = refusal::kind::too_small, .member = "total", .value = total.raw, .limit = 1};
  if (*count > UINT32_MAX)
    return refusal{
        .what = refusal::kind::too_large, .member = "total", .value = total.raw, .limit = UINT32_MAX};
  into.fragment_count = static_cast<std::uint32_t>(*count);
  into.fragment_count_exact = is_integer(total);
  return std::nullopt;
}

std::optional<refusal> read_timeout(std::string_view member, const json::value& v,
                                    std::int64_t& into) noexcept {
  const auto seconds = json::to_double(v);
  if (!seconds) return wrong_type(member, v, "seconds");
  if (*seconds < 0) return negative(member, v);
  into = *seconds == 0 ? unlimited : nanoseconds_of(*seconds);
  if (into == 0) into = 1; // short, but not none
  return std::nullopt;
}

std::optional<refusal> read_duration(std::string_view member, const json::value& v,
                                     std::int64_t& into) noexcept {
  constexpr std::string_view expected = R"(seconds, {"secs":s,"nsecs":n} or "infinite")";
  if (is_word(v, "infinite")) {
    into = unlimited;
    return std::nullopt;
  }
  if (const auto seconds = json::to_double(v)) {
    if (*seconds < 0) return negative(member, v);
    into = nanoseconds_of(*seconds);
    return std::nullopt;
  }
  if (v.type != json::kind::object) return wrong_type(member, v, expected);
  static constexpr word_table names{"secs", "nsecs"};
  const auto parts = collect(v.raw, names);
  const auto seconds = json::to_integer(parts.values[0]);
  const auto nanoseconds = json::to_integer(parts.values[1]);
  if (parts.twice() || !seconds || !nanoseconds) return wrong_type(member, v, expected);
  if (*seconds < 0 || *nanoseconds < 0) return negative(member, v);
  into = nanoseconds_of(*seconds, *nanoseconds);
  return std::nullopt;
}

std::optional<refusal> read_word(std::string_view member, const json::value& v,
                                 std::span<const std::string_view> words, std::string_view expected,
                                 std::size_t& into) noexcept {
  const auto known =
      std::find_if(words.begin(), words.end(), [&v](std::string_view w) { return is_word(v, w); });
  if (known == words.end()) return wrong_type(member, v, expected);
  into = static_cast<std::size_t>(known - words.begin());
  return std::nullopt;
}

std::optional<refusal> read_name(std::string_view member, const json::value& v, std::size_t bytes_max,
                                 std::span<char> scratch, std::string_view& into) noexcept {
  if (v.type != json::kind::string) return wrong_type(member, v, "a string");
  if (const std::string_view escaped = v.raw.substr(1, v.raw.size() - 2);
      escaped.size() <= bytes_max && is_plain(escaped)) {
    into = escaped;
    return std::nullopt;
  }
  const auto text = json::to_string(v, scratch);
  if (!text || text->size() > bytes_max) return too_long(member, v.raw.size() - 2, bytes_max);
  if (has_control_characters(*text)) {
    return bad_characters(member, v);
  }
  into = *text;
  return std::nullopt;
}

bool names_operation(std::string_view text) noexcept {
  std::size_t from = 0;
  for (bool first = true; const auto value = behind_name(text, R"("op")", from); first = false) {
    const std::size_t name = text.find('"');
    if (first && text.substr(name).starts_with(R"("op")") && value->starts_with('"')) return true;
    if (!value->starts_with('"')) continue;
    const std::string_view word = value->substr(1, value->find('"', 1) - 1);
    if (word.size() + 1 < value->size() && operation_names.find(word) != operation_names.size()) return true;
  }
  return false;
}

} // namespace rowe::wire::rosbridge
