// SPDX-License-Identifier: Apache-2.0
// Limits by name: sets them from a program's options and environment. Set-up.
#include <rowe/limits.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "service/limit_table.hpp"

namespace rowe {
namespace {

using service::limit_row;
using service::limit_table;

constexpr std::string_view variable_prefix = "ROWE_LIMIT_";

constexpr auto limit_names = [] {
  std::array<std::string_view, limit_table.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = name_of(limit_table[i].which);
  return names;
}();

const limit_row* find_limit(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(limit_names, name);
  if (found == limit_names.end()) return nullptr;
  return &limit_table[static_cast<std::size_t>(found - limit_names.data())];
}

// Sets one limit. `shown` is its name as the user wrote it.
status set_as(limits& in, const limit_row& row, std::string_view shown, std::string_view value,
              std::string* why) {
  std::uint64_t number = 0;
  const char* const end = value.data() + value.size();
  const auto [read_to, failure] = std::from_chars(value.data(), end, number);
  const bool is_number = failure != std::errc::invalid_argument && read_to == end && !value.empty();
  if (is_number && failure == std::errc{} && number >= row.least && number <= row.most) {
    row.set(in, number);
    return {};
  }
  const std::string range = std::to_string(row.least) + " to " + std::to_string(row.most);
  if (why != nullptr) {
    why->assign(shown).append(is_number ? " is out of range: " : " needs a whole number, not ");
    why->append(is_number ? "" : "\"").append(value).append(is_number ? "" : "\"").append(" (");
    why->append(range).append(")");
  }
  const bool below = is_number && failure == std::errc{} && number < row.least;
  return error{errc::bad_argument, static_cast<std::int64_t>(std::min<std::uint64_t>(number, INT64_MAX)),
               static_cast<std::int64_t>(below ? row.least : row.most), row.which};
}

status unknown(std::string_view shown, std::string* why) {
  if (why != nullptr) {
    why->assign("there is no limit ").append(shown).append("; there are");
    for (const std::string_view one : limit_names)
      why->append(one.data() == limit_names[0].data() ? " " : ", ").append(one);
  }
  return errc::bad_argument;
}

std::string lowered(std::string_view text) {
  std::string lower{text};
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

} // namespace

std::span<const std::string_view> limits::names() noexcept { return limit_names; }

status limits::set(std::string_view name, std::string_view value, std::string* why) {
  const limit_row* const row = find_limit(name);
  return row == nullptr ? unknown(name, why) : set_as(*this, *row, name, value, why);
}

result<limits> limits::with_environment(std::string* why) const {
  limits made = *this;
  for (char** one = environ; one != nullptr && *one != nullptr; ++one) {
    const std::string_view entry = *one;
    const auto equals = entry.find('=');
    if (!entry.starts_with(variable_prefix) || equals == entry.npos) continue;
    const std::string_view variable = entry.substr(0, equals);
    const limit_row* const row = find_limit(lowered(variable.substr(variable_prefix.size())));
    const status done =
        row == nullptr ? unknown(variable, why) : set_as(made, *row, variable, entry.substr(equals + 1), why);
    if (!done) return done.error();
  }
  return made;
}

} // namespace rowe
