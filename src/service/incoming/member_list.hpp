// SPDX-License-Identifier: Apache-2.0
// A small object in place of a long one: enough to know what a message that is refused asks for. Nothing
// waits or allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>
#include <string_view>

#include "service/base/stand_in.hpp"
#include "json/reading/scanner.hpp"

namespace rowe::service {

// Longer values are replaced by a stand-in.
inline constexpr std::size_t listed_value_bytes_max = 1024;

// Writes an object of those of a text's members that fit. Returns its length. `copy(stretch, into)` gives
// what stands at a place of the text; it is asked in the order of the text.
template <class Copy>
std::size_t list_members(std::span<const json::placed_member> members, std::span<std::byte> into,
                         const Copy& copy) noexcept {
  assert(into.size() >= 2);
  std::size_t used = 0;
  const auto add = [&](std::string_view words) {
    std::memcpy(into.data() + used, words.data(), words.size());
    used += words.size();
  };
  const auto add_stretch = [&](json::stretch of) {
    copy(of, into.subspan(used, of.bytes));
    used += of.bytes;
  };
  add("{");
  for (const json::placed_member& one : members) {
    const bool whole = one.raw.bytes <= listed_value_bytes_max;
    const std::string_view stand_in = stand_in_for(one.type);
    const std::size_t bytes = one.name.bytes + (whole ? one.raw.bytes : stand_in.size());
    if (used + bytes + std::string_view{R"(,"":})"}.size() > into.size()) continue;
    if (used != 1) add(",");
    add("\"");
    add_stretch(one.name);
    add("\":");
    whole ? add_stretch(one.raw) : add(stand_in);
  }
  add("}");
  return used;
}

} // namespace rowe::service
