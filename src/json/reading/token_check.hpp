// SPDX-License-Identifier: Apache-2.0
// Is a text JSON, and which members does it have? This uses what simdjson's first stage has found: the first
// byte of every token, in a text that is UTF-8 and whose strings all end and have no control characters. It
// checks the order of the tokens, numbers, words and escapes. It is quick, so it may refuse valid texts
// (numbers of hundreds of digits or with long exponents, a number that is the whole text, deep nesting); it
// never accepts invalid ones. Pure, on any thread; never waits, never allocates; steps in proportion to the
// text.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "json/reading/reader.hpp"

namespace rowe::json {

struct member_index {
  std::size_t count = 0;
  const char* behind = nullptr; // where the last of them ends
  bool all = false;             // the object has no others
};

// `tokens`: the index of each token, ascending. If the whole text is an object, its first members are indexed
// in `indexed`. 32 bytes behind the text must be readable. `depth_max` is at most fault_depth_limit.
bool tokens_are_valid(std::string_view text, std::span<const std::uint32_t> tokens, std::size_t depth_max,
                      std::span<member> indexed, member_index& found) noexcept;

// Is every backslash in `text` the beginning of a valid escape?
bool escapes_are_valid(std::string_view text) noexcept;

} // namespace rowe::json
