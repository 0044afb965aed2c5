// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <string_view>

#include "json/text/words.hpp"

namespace rowe::json {

// Lists the names of an enum for a diagnostic, `"off", "on" or one of 7 others`. `name_of(i)` is each of
// them. Never waits, never allocates.
template <class NameOf>
void add_names(words& to, std::size_t count, std::size_t name_bytes_max, const NameOf& name_of) noexcept {
  constexpr std::size_t bytes_max = 96; // a status of 256 bytes has room for what was found
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view name = name_of(i);
    bytes += std::min(name.size(), name_bytes_max) + 4;
    if (bytes > bytes_max) {
      to.add(" or one of ").add(count - i).add(" others");
      return;
    }
    to.add(i == 0 ? "\"" : i + 1 == count ? " or \"" : ", \"");
    to.add_shortened(name, name_bytes_max).add("\"");
  }
}

} // namespace rowe::json
