// SPDX-License-Identifier: Apache-2.0
// Reads the lists of topics and services that the numbers codec writes.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "wire/numbers_codec.hpp"

namespace numbers {

// Name to number, as a list says it.
using numbered = std::map<std::string, std::uint32_t>;

inline numbered list_of(const std::vector<std::string>& heard, char kind) {
  numbered all;
  for (std::string_view text : heard) {
    if (!text.starts_with(kind)) continue;
    for (text.remove_prefix(1); text.size() >= 8;) {
      const std::uint32_t number = number_at(text);
      const std::size_t bytes = number_at(text.substr(4));
      all[std::string{text.substr(8, bytes)}] = number;
      text.remove_prefix(8 + bytes);
    }
  }
  return all;
}

inline std::vector<std::uint32_t> gone_of(const std::vector<std::string>& heard, char kind) {
  std::vector<std::uint32_t> all;
  for (const std::string_view text : heard) {
    for (std::size_t at = 1; text.starts_with(kind) && at + 8 <= text.size(); at += 8)
      all.push_back(number_at(text.substr(at)));
  }
  return all;
}

} // namespace numbers
