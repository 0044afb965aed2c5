// SPDX-License-Identifier: Apache-2.0
// UTF-8, one sequence at a time (RFC 3629). Text that is not well-formed is cut into the maximal pieces of
// the Unicode Standard, section 3.9, as in browsers. Pure functions, on any thread; nothing waits or
// allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/rt/attributes.hpp>

namespace rowe::json {

// U+FFFD, which replaces bytes that are no UTF-8.
inline constexpr char replacement_character[] = "\xef\xbf\xbd";

struct utf8_piece {
  std::size_t bytes; // at least 1
  bool valid; // a whole sequence; else the beginning of one that goes wrong, or a byte that begins none
};

// The piece that begins at `at`, which is before `end`.
ROWE_RT inline utf8_piece next_utf8(const char* at, const char* end) noexcept {
  assert(at < end);
  const auto byte = [at](std::size_t i) { return static_cast<std::uint8_t>(at[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return {1, true};
  if (lead < 0xc2 || lead > 0xf4) return {1, false}; // continuation, overlong, or beyond U+10FFFF
  // Only the second byte is restricted further: overlong forms, surrogates, the end of Unicode.
  const std::uint8_t low = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
  const std::uint8_t high = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
  const std::size_t bytes = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  const auto left = static_cast<std::size_t>(end - at);
  if (left < 2 || byte(1) < low || byte(1) > high) return {1, false};
  for (std::size_t i = 2; i < bytes; ++i) {
    if (i == left || (byte(i) & 0xc0) != 0x80) return {i, false};
  }
  return {bytes, true};
}

// The longest beginning of `text`, which is UTF-8, that has at most `bytes_max` bytes and ends between
// characters.
ROWE_RT inline std::string_view utf8_prefix(std::string_view text, std::size_t bytes_max) noexcept {
  if (text.size() <= bytes_max) return text;
  std::size_t bytes = bytes_max;
  while (bytes > 0 && (static_cast<std::uint8_t>(text[bytes]) & 0xc0) == 0x80) --bytes;
  return text.substr(0, bytes);
}

// Writes `code_point` (no surrogate, at most U+10FFFF) as UTF-8 to `at`, which has four bytes; returns how
// many it used.
ROWE_RT inline std::size_t write_utf8(char* at, std::uint32_t code_point) noexcept {
  assert(code_point <= 0x10ffff && (code_point < 0xd800 || code_point > 0xdfff));
  const auto continuation = [code_point](int shift) {
    return static_cast<char>(0x80 | (code_point >> shift & 0x3f));
  };
  if (code_point < 0x80) {
    at[0] = static_cast<char>(code_point);
    return 1;
  }
  if (code_point < 0x800) {
    at[0] = static_cast<char>(0xc0 | code_point >> 6);
    at[1] = continuation(0);
    return 2;
  }
  if (code_point < 0x10000) {
    at[0] = static_cast<char>(0xe0 | code_point >> 12);
    at[1] = continuation(6);
    at[2] = continuation(0);
    return 3;
  }
  at[0] = static_cast<char>(0xf0 | code_point >> 18);
  at[1] = continuation(12);
  at[2] = continuation(6);
  at[3] = continuation(0);
  return 4;
}

} // namespace rowe::json
