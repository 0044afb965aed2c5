// SPDX-License-Identifier: Apache-2.0
// Limits by name: sets them from a program's options and environment. Set-up.
#include <rowe/limits.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>

#include "config/environment.hpp"
#include "config/keys.hpp"
#include "service/base/limit_table.hpp"

namespace rowe {
namespace {

using config::key;
using service::limit_table;

constexpr auto limit_names = [] {
  std::array<std::string_view, limit_table.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = name_of(limit_table[i].which);
  return names;
}();

const key<configuration>* find_limit(std::string_view name) noexcept {
  const std::size_t at = config::find("limits", name);
  return at == config::keys().size() ? nullptr : &config::keys()[at];
}

// Sets one limit. `shown` is its name as the user wrote it.
status set_as(limits& in, const key<configuration>& one, std::string_view shown, std::string_view text,
              std::string* why) {
  config::value read = std::int64_t{0};
  const std::string wrong = config::read(one.what, text, read);
  const std::int64_t number = std::get<std::int64_t>(read);
  if (wrong.empty()) {
    const auto* const row = std::ranges::find(limit_table, one.which, &service::limit_row::which);
    row->set(in, static_cast<std::uint64_t>(number));
    return {};
  }
  if (why != nullptr) why->assign(shown).append(" ").append(wrong);
  return error{errc::bad_argument, number, number < one.what.least ? one.what.least : one.what.most,
               one.which};
}

status unknown(std::string_view shown, std::string* why) {
  if (why != nullptr) {
    why->assign("there is no limit ").append(shown).append("; there are");
    for (const std::string_view one : limit_names)
      why->append(one.data() == limit_names[0].data() ? " " : ", ").append(one);
  }
  return errc::bad_argument;
}

} // namespace

std::span<const std::string_view> limits::names() noexcept { return limit_names; }

status limits::set(std::string_view name, std::string_view value, std::string* why) {
  const key<configuration>* const row = find_limit(name);
  return row == nullptr ? unknown(name, why) : set_as(*this, *row, name, value, why);
}

result<limits> limits::with_environment(std::string* why) const {
  limits made = *this;
  for (char** one = environ; one != nullptr && *one != nullptr; ++one) {
    const std::string_view entry = *one;
    const auto equals = entry.find('=');
    if (!entry.starts_with("ROWE_LIMIT") || equals == entry.npos) continue;
    const std::string_view variable = entry.substr(0, equals);
    const std::size_t at = config::find_variable(variable);
    if (at == config::keys().size()) {
      const std::string wrong = config::unknown_variable(variable);
      if (wrong.empty()) continue; // ROWE_LIMITED, say
      if (why != nullptr) *why = wrong;
      return errc::bad_argument;
    }
    const status done = set_as(made, config::keys()[at], variable, entry.substr(equals + 1), why);
    if (!done) return done.error();
  }
  return made;
}

} // namespace rowe
