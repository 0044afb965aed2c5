// SPDX-License-Identifier: Apache-2.0
#include "values.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <span>

namespace rowe::tools {
namespace {

// A number in front, and what stands behind it. Exponents are no part of it: "1e" would swallow a unit's
// letter.
struct quantity {
  double number = 0;
  std::string_view unit;
};

std::optional<quantity> quantity_of(std::string_view text) noexcept {
  if (text.empty() || (text.front() != '.' && (text.front() < '0' || text.front() > '9')))
    return std::nullopt;
  quantity read;
  const char* const end = text.data() + text.size();
  const auto [rest, failure] = std::from_chars(text.data(), end, read.number, std::chars_format::fixed);
  if (failure != std::errc{}) return std::nullopt;
  read.unit = {rest, static_cast<std::size_t>(end - rest)};
  return read;
}

struct unit {
  std::string_view name;
  double factor;
};

std::optional<double> factor_of(std::string_view name, std::span<const unit> units) noexcept {
  const auto* const found =
      std::find_if(units.data(), units.data() + units.size(), [&](const unit& u) { return u.name == name; });
  if (found == units.data() + units.size()) return std::nullopt;
  return found->factor;
}

constexpr std::array<unit, 8> time_units{{{"ns", 1},
                                          {"us", 1e3},
                                          {"µs", 1e3},
                                          {"ms", 1e6},
                                          {"s", 1e9},
                                          {"m", 60e9},
                                          {"min", 60e9},
                                          {"h", 3600e9}}};
constexpr std::array<unit, 5> rate_units{{{"", 1}, {"Hz", 1}, {"hz", 1}, {"kHz", 1e3}, {"khz", 1e3}}};
constexpr std::array<unit, 11> byte_units{{{"", 1},
                                           {"B", 1},
                                           {"kB", 1e3},
                                           {"KB", 1e3},
                                           {"MB", 1e6},
                                           {"GB", 1e9},
                                           {"TB", 1e12},
                                           {"KiB", 1024},
                                           {"MiB", 1024.0 * 1024},
                                           {"GiB", 1024.0 * 1024 * 1024},
                                           {"TiB", 1024.0 * 1024 * 1024 * 1024}}};

} // namespace

std::optional<std::int64_t> integer_of(std::string_view text) noexcept {
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, failure] = std::from_chars(text.data(), end, value);
  if (failure != std::errc{} || rest != end) return std::nullopt;
  return value;
}

std::optional<rt::duration> duration_of(std::string_view text) noexcept {
  const auto read = quantity_of(text);
  if (!read) return std::nullopt;
  if (read->number == 0 && read->unit.empty()) return rt::duration{0};
  const auto factor = factor_of(read->unit, time_units);
  if (!factor) return std::nullopt;
  const double ns = read->number * *factor;
  if (!(ns < static_cast<double>(rt::for_ever.count()))) return rt::for_ever;
  return rt::duration{std::llround(ns)};
}

std::optional<double> rate_of(std::string_view text) noexcept {
  const auto read = quantity_of(text);
  if (!read || !(read->number > 0)) return std::nullopt;
  const auto factor = factor_of(read->unit, rate_units);
  if (!factor) return std::nullopt;
  return read->number * *factor;
}

std::optional<std::uint64_t> bytes_of(std::string_view text) noexcept {
  const auto read = quantity_of(text);
  if (!read) return std::nullopt;
  const auto factor = factor_of(read->unit, byte_units);
  if (!factor) return std::nullopt;
  const double bytes = std::floor(read->number * *factor);
  if (!(bytes >= 1) || !(bytes < 0x1p63)) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

// Optimal string alignment: the edit distance of Levenshtein with swaps of neighbours, three rows of its
// table at a time.
std::size_t slips_between(std::string_view one, std::string_view other) noexcept {
  constexpr std::size_t letters_max = 128;
  if (one.size() > letters_max || other.size() > letters_max) return std::max(one.size(), other.size());
  using row = std::array<std::size_t, letters_max + 1>;
  row before_last{}, last{}, current{};
  for (std::size_t j = 0; j <= other.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= one.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= other.size(); ++j) {
      const std::size_t changed = last[j - 1] + (one[i - 1] == other[j - 1] ? 0 : 1);
      current[j] = std::min({changed, last[j] + 1, current[j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && one[i - 1] == other[j - 2] && one[i - 2] == other[j - 1];
      if (swapped) current[j] = std::min(current[j], before_last[j - 2] + 1);
    }
    before_last = last;
    last = current;
  }
  return last[other.size()];
}

} // namespace rowe::tools
