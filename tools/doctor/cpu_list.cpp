// SPDX-License-Identifier: Apache-2.0
#include "cpu_list.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <utility>

#include "../rowe/console.hpp"

namespace rowe::tools::fitness {
namespace {

template <class Number>
std::optional<Number> number_of(std::string_view digits, int base) {
  Number number{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number, base);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return number;
}

// "3" or "3-5".
std::optional<std::pair<int, int>> range_of(std::string_view text) {
  const std::size_t dash = text.find('-');
  const auto first = number_of<int>(text.substr(0, dash), 10);
  const auto last = dash == std::string_view::npos ? first : number_of<int>(text.substr(dash + 1), 10);
  if (!first || !last || *first < 0 || *last < *first || *last > cpu_list::cpu_max) return std::nullopt;
  return std::pair{*first, *last};
}

} // namespace

cpu_list::cpu_list(std::vector<int> cpus) : cpus_{std::move(cpus)} {
  std::ranges::sort(cpus_);
  cpus_.erase(std::unique(cpus_.begin(), cpus_.end()), cpus_.end());
}

std::optional<cpu_list> cpu_list::of_list(std::string_view text) {
  std::vector<int> cpus;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const auto range = range_of(text.substr(0, comma));
    if (!range) return std::nullopt;
    for (int cpu = range->first; cpu <= range->second; ++cpu) cpus.push_back(cpu);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
    if (text.empty()) return std::nullopt; // a comma and nothing after it
  }
  return cpu_list{std::move(cpus)};
}

std::optional<cpu_list> cpu_list::of_mask(std::string_view text) {
  std::vector<int> cpus;
  int first = 0; // cpu of the word's lowest bit
  while (!text.empty() && first <= cpu_max) {
    const std::size_t comma = text.rfind(',');
    const std::size_t from = comma == std::string_view::npos ? 0 : comma + 1;
    const auto word = number_of<std::uint32_t>(text.substr(from), 16);
    if (!word) return std::nullopt;
    for (int bit = 0; bit < 32; ++bit) {
      if ((*word >> bit & 1U) != 0) cpus.push_back(first + bit);
    }
    first += 32;
    text = text.substr(0, from == 0 ? 0 : comma);
  }
  return cpu_list{std::move(cpus)};
}

bool cpu_list::contains(int cpu) const noexcept { return std::ranges::binary_search(cpus_, cpu); }

bool cpu_list::contains_all(const cpu_list& others) const noexcept {
  return std::ranges::includes(cpus_, others.cpus_);
}

cpu_list cpu_list::both(const cpu_list& others) const {
  cpu_list shared;
  std::ranges::set_intersection(cpus_, others.cpus_, std::back_inserter(shared.cpus_));
  return shared;
}

cpu_list cpu_list::without(const cpu_list& others) const {
  cpu_list rest;
  std::ranges::set_difference(cpus_, others.cpus_, std::back_inserter(rest.cpus_));
  return rest;
}

std::string cpu_list::text() const {
  std::string text;
  for (std::size_t i = 0; i < cpus_.size();) {
    std::size_t last = i;
    while (last + 1 < cpus_.size() && cpus_[last + 1] == cpus_[last] + 1) ++last;
    text.append(joined(text.empty() ? "" : ",", cpus_[i]));
    if (last != i) text.append(joined("-", cpus_[last]));
    i = last + 1;
  }
  return text;
}

} // namespace rowe::tools::fitness
