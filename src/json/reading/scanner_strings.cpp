// SPDX-License-Identifier: Apache-2.0
// The scanner within strings.
#include <cstring>

#include "json/reading/scanner.hpp"
#include "json/text/block.hpp"
#include "json/text/bytes.hpp"
#include "json/text/characters.hpp"
#include "json/text/utf8.hpp"

namespace rowe::json {
namespace {

// May it follow a backslash, other than a `u`?
bool is_escaped(char c) noexcept { return std::memchr("\"\\/bfnrt", c, 8) != nullptr; }

// The first byte from `at` on that does not simply continue a string of ASCII, or `end`.
const char* skip_plain(const char* at, const char* end) noexcept {
  while (end - at >= block::bytes && !block{at}.has_special()) at += block::bytes;
  for (; end - at >= 8; at += 8) {
    const std::uint64_t special = special_bytes(load_eight(at));
    if (special != 0) return at + first_byte(special);
  }
  if (at == end) return at;
  const auto left = static_cast<std::size_t>(end - at);
  const std::uint64_t special = special_bytes(load_fewer(at, left)); // the spaces behind are not special
  return special != 0 ? at + first_byte(special) : end;
}

// The code unit of \uXXXX at `at`, if that is complete in this piece; else more than any is.
std::uint32_t unit_at(const char* at, const char* end) noexcept {
  constexpr std::uint32_t no_unit = 0x10000;
  if (end - at < 6 || at[0] != '\\' || at[1] != 'u') return no_unit;
  std::uint32_t unit = 0;
  for (int i = 2; i < 6; ++i) {
    const unsigned digit = hex_value(at[i]);
    if (digit > 15) return no_unit;
    unit = unit << 4 | digit;
  }
  return unit;
}

// Behind the escape at `at`, or the two of a pair of surrogates, if complete in this piece; else `at`.
const char* skip_escape(const char* at, const char* end) noexcept {
  if (end - at < 2 || *at != '\\') return at;
  if (at[1] != 'u') return is_escaped(at[1]) ? at + 2 : at;
  const std::uint32_t unit = unit_at(at, end);
  if (unit > 0xffff) return at;
  if (unit < 0xd800 || unit > 0xdfff) return at + 6;
  return unit < 0xdc00 && unit_at(at + 6, end) >> 10 == 0xdc00 >> 10 ? at + 12 : at;
}

// Behind the characters at `at` that are not ASCII and complete in this piece.
const char* skip_characters(const char* at, const char* end) noexcept {
  while (at != end && static_cast<std::uint8_t>(*at) >= 0x80) {
    const utf8_piece whole = next_utf8(at, end);
    if (!whole.valid) break;
    at += whole.bytes;
  }
  return at;
}

} // namespace

const char* scanner::in_string(const char* at, const char* end) noexcept {
  const char* behind = at;
  do {
    at = skip_plain(behind, end);
    behind = skip_characters(skip_escape(at, end), end);
  } while (behind != at);
  if (at == end) return at;
  const auto byte = static_cast<std::uint8_t>(*at);
  if (byte == '"') {
    if (!in_name_) {
      end_value(place_of(at) + 1);
    } else {
      if (is_indexed_level()) next_.name.bytes = place_of(at) - next_.name.at;
      state_ = state::colon;
    }
    return at + 1;
  }
  if (byte == '\\') {
    mark_ = place_of(at);
    state_ = state::escape;
    return at + 1;
  }
  return byte < 0x80 ? wrong(at) : begin_character(at, end);
}

const char* scanner::begin_character(const char* at, const char* end) noexcept {
  constexpr std::ptrdiff_t longest = 4;
  if (end - at >= longest) return wrong(at); // else it would have been skipped
  const auto lead = static_cast<std::uint8_t>(*at);
  if (lead < 0xc2 || lead > 0xf4) return wrong(at);
  mark_ = place_of(at);
  missing_ = lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
  low_ = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;  // below: overlong
  high_ = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf; // above: surrogates, or beyond U+10FFFF
  state_ = state::character;
  return at + 1;
}

const char* scanner::in_character(const char* at) noexcept {
  const auto byte = static_cast<std::uint8_t>(*at);
  if (byte < low_ || byte > high_) return wrong_at(mark_);
  low_ = 0x80;
  high_ = 0xbf;
  if (--missing_ == 0) state_ = state::string;
  return at + 1;
}

const char* scanner::in_escape(const char* at) noexcept {
  switch (state_) {
  case state::escape:
    if (*at == 'u') {
      state_ = state::unit;
      unit_ = 0;
      unit_digits_ = 0;
      low_half_ = false;
      return at + 1;
    }
    if (!is_escaped(*at)) return wrong(at);
    state_ = state::string;
    return at + 1;
  case state::low_backslash:
    if (*at != '\\') return wrong_at(mark_); // an unpaired surrogate is wrong where it begins
    state_ = state::low_u;
    return at + 1;
  case state::low_u:
    if (*at != 'u') return wrong_at(mark_);
    state_ = state::unit;
    unit_ = 0;
    unit_digits_ = 0;
    low_half_ = true;
    return at + 1;
  default: return in_unit(at);
  }
}

const char* scanner::in_unit(const char* at) noexcept {
  const unsigned digit = hex_value(*at);
  if (digit > 15) return low_half_ ? wrong_at(mark_) : wrong(at);
  unit_ = unit_ << 4 | digit;
  if (++unit_digits_ < 4) return at + 1;
  const bool high_surrogate = unit_ >= 0xd800 && unit_ <= 0xdbff;
  const bool low_surrogate = unit_ >= 0xdc00 && unit_ <= 0xdfff;
  if (low_surrogate != low_half_) return wrong_at(mark_);
  state_ = high_surrogate ? state::low_backslash : state::string;
  return at + 1;
}

} // namespace rowe::json
