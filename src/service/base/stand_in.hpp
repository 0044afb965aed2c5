// SPDX-License-Identifier: Apache-2.0
// A small value in place of a long one: enough to know what a message asks for, and to compose what is sent
// on. Whoever composes a message around a long text writes it with the stand-in, finds where that got to, and
// leaves its place to the text. Nothing waits or allocates.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "service/base/ids.hpp"
#include "wire/codec/object_form.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

// What each stand-in says. A text that says it twice is refused, since its place is not known then.
inline constexpr std::string_view long_mark = "<a long value>";

// A value of the same kind, so that a decoder judges the stand-in as it would judge the value.
constexpr std::string_view stand_in_for(json::kind type) noexcept {
  switch (type) {
  case json::kind::object: return wire::long_object;
  case json::kind::array: return R"(["<a long value>"])";
  case json::kind::string: return R"("<a long value>")";
  default: return "null";
  }
}

// A long text, and what stands for it.
struct long_value {
  text_id text{}; // none: nothing is long
  std::string_view stand_in{};

  explicit operator bool() const noexcept { return static_cast<bool>(text); }
};

// Where a stand-in got to in a text that was written with it.
struct stand_in_place {
  std::size_t at = 0;
  std::size_t bytes = 0;
};
// None: it is not there, or more than once.
inline std::optional<stand_in_place> find_stand_in(std::string_view text,
                                                   std::string_view stand_in) noexcept {
  const std::size_t mark = text.find(long_mark);
  if (mark == std::string_view::npos || text.find(long_mark, mark + 1) != std::string_view::npos)
    return std::nullopt;
  const std::size_t before = stand_in.find(long_mark);
  if (before > mark || text.substr(mark - before, stand_in.size()) != stand_in) return std::nullopt;
  return stand_in_place{mark - before, stand_in.size()};
}

} // namespace rowe::service
