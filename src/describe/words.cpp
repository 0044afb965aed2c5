// SPDX-License-Identifier: Apache-2.0
#include "words.hpp"

#include <algorithm>

#include "json/writing/writer.hpp"

namespace rowe::describe_words {

std::string quoted(std::string_view text) {
  constexpr std::size_t escaped_bytes_max = 6; // \u001f
  std::string buffer(text.size() * escaped_bytes_max + 2, '\0');
  json::writer w{buffer};
  w.string(text);
  buffer.resize(w.bytes());
  return buffer;
}

bool is_name(std::string_view text) noexcept {
  const auto may_begin = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !text.empty() && may_begin(text.front()) && std::all_of(text.begin(), text.end(), [&](char c) {
    return may_begin(c) || (c >= '0' && c <= '9');
  });
}

bool is_integer(value_kind kind) noexcept { return kind >= value_kind::int8 && kind <= value_kind::uint64; }

std::string number(std::int64_t value, value_kind kind) {
  return kind == value_kind::uint64 ? std::to_string(static_cast<std::uint64_t>(value))
                                    : std::to_string(value);
}

std::string unit(const value_description& value, bool as_seconds) {
  const unit_description& u = value.unit;
  if (u.denominator == 0) return {};
  struct known {
    std::int64_t numerator, denominator;
    std::string_view name;
  };
  constexpr known units[] = {{1, 1, "seconds"},
                             {1, 1'000, "milliseconds"},
                             {1, 1'000'000, "microseconds"},
                             {1, 1'000'000'000, "nanoseconds"},
                             {60, 1, "minutes"},
                             {3600, 1, "hours"},
                             {86400, 1, "days"}};
  std::string text =
      "units of " + std::to_string(u.numerator) + "/" + std::to_string(u.denominator) + " seconds";
  if (as_seconds) text = "seconds";
  for (const known& k : units) {
    if (!as_seconds && k.numerator == u.numerator && k.denominator == u.denominator) text = k.name;
  }
  return text + (u.since_1970 ? " since 1970" : "");
}

element_count count_of(const value_description& array, const member_description* counted) noexcept {
  if (counted != nullptr && counted->count != nullptr) return {counted->count_limit, false};
  return {array.count_max, array.count == nullptr};
}

} // namespace rowe::describe_words
