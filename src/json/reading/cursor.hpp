// SPDX-License-Identifier: Apache-2.0
// Steps through text that is known to be JSON, for the walkers and the decoder. They look only at brackets,
// quotes and commas. Nothing checks again what reader::validate() has checked. But every step looks at `end`
// first and moves forward, so on any other text it stays inside and ends.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "json/text/block.hpp"
#include "json/text/characters.hpp"
#include "json/text/utf8.hpp"

namespace rowe::json {

inline std::string_view between(const char* begin, const char* end) noexcept {
  return {begin, static_cast<std::size_t>(end - begin)};
}

// Between the tokens of a valid text, every byte up to a space is white space.
inline bool is_space(char c) noexcept { return static_cast<std::uint8_t>(c) <= ' '; }

inline const char* skip_space(const char* at, const char* end) noexcept {
  while (at != end && is_space(*at)) ++at;
  return at;
}

// From behind the opening quote to the closing one; `end` if there is none.
inline const char* find_quote(const char* at, const char* end) noexcept {
  while (end - at >= block::bytes) {
    const block b{at};
    const std::uint32_t quotes = b.equal('"');
    const std::uint32_t marks = quotes | b.equal('\\');
    if (marks == 0) {
      at += block::bytes;
      continue;
    }
    at += std::countr_zero(marks);
    if (((marks & (0 - marks)) & quotes) != 0) return at;
    if (end - at < 2) return end;
    at += 2; // a backslash and what it escapes
  }
  while (at != end && *at != '"') {
    if (*at == '\\' && ++at == end) return end;
    ++at;
  }
  return at;
}

// From a quote to behind the string that it opens.
inline const char* skip_string(const char* at, const char* end) noexcept {
  const char* const quote = find_quote(at + 1, end);
  return quote == end ? end : quote + 1;
}

// Finds the bracket that closes the first one, 32 bytes a step. It counts quotes to find which bytes are
// inside strings. A stretch with a backslash, which may escape quotes, is looked at byte by byte.
class container_end {
 public:
  container_end(const char* begin, const char* end) noexcept : at_{begin}, end_{end} {}

  // Behind the bracket; `end` when there is none.
  const char* find() noexcept {
    while (end_ - at_ >= block_pair::bytes) {
      const block_pair b{at_};
      if (b.equal('\\') != 0) [[unlikely]] {
        if (found_by_bytes(at_ + block_pair::bytes)) return at_;
        continue;
      }
      const std::uint32_t inside = in_string_ ? ~odd_so_far(b.equal('"')) : odd_so_far(b.equal('"'));
      in_string_ = inside >> 31 != 0;
      const std::uint32_t opening = b.equal_but_for_bit_5('{') & ~inside;
      const std::uint32_t closing = b.equal_but_for_bit_5('}') & ~inside;
      for (std::uint32_t left = opening | closing; left != 0; left &= left - 1) {
        const std::uint32_t lowest = left & (0 - left);
        if ((opening & lowest) != 0) {
          ++depth_;
        } else if (--depth_ == 0) {
          return at_ + std::countr_zero(lowest) + 1;
        }
      }
      at_ += block_pair::bytes;
    }
    return found_by_bytes(end_) ? at_ : end_;
  }

 private:
  // Looks up to `stop`, or one byte further if an escape begins before it. True: the bracket is found, and
  // at_ is behind it.
  bool found_by_bytes(const char* stop) noexcept {
    while (at_ < stop) {
      const char c = *at_++;
      if (c == '"') {
        in_string_ = !in_string_;
      } else if (in_string_) {
        if (c == '\\' && at_ != end_) ++at_;
      } else if (c == '{' || c == '[') {
        ++depth_;
      } else if ((c == '}' || c == ']') && --depth_ == 0) {
        return true;
      }
    }
    return false;
  }

  const char* at_;
  const char* const end_;
  std::size_t depth_ = 0;
  bool in_string_ = false;
};

inline const char* skip_container(const char* at, const char* end) noexcept {
  return container_end{at, end}.find();
}

// Moves to the comma, bracket or white space behind a number or a word.
inline const char* skip_scalar(const char* at, const char* end) noexcept {
  for (; end - at >= block::bytes; at += block::bytes) {
    const block b{at};
    const std::uint32_t marks = b.equal(',') | b.equal_but_for_bit_5('}') | b.at_most(' ');
    if (marks != 0) return at + std::countr_zero(marks);
  }
  return std::find_if(at, end, [](char c) { return c == ',' || c == '}' || c == ']' || is_space(c); });
}

// ---- escapes ----

inline std::uint32_t code_unit(const char* four) noexcept {
  const auto half = [](char c) { return hex_value(c) & 15; };
  return half(four[0]) << 12 | half(four[1]) << 8 | half(four[2]) << 4 | half(four[3]);
}

inline char unescaped(char c) noexcept {
  switch (c) {
  case 'b': return '\b';
  case 'f': return '\f';
  case 'n': return '\n';
  case 'r': return '\r';
  case 't': return '\t';
  default: return c; // a quote, a slash or a backslash
  }
}

// Writes the character of the escape at `at` (a backslash), moves `at` behind it, and returns how many bytes
// it wrote. An unpaired surrogate or an escape that is cut off, which only text has that was not validated,
// becomes U+FFFD.
inline std::size_t take_escape(const char*& at, const char* end, std::span<char, 4> into) noexcept {
  constexpr std::uint32_t replacement = 0xfffd;
  if (end - at >= 2 && at[1] != 'u') {
    into[0] = unescaped(at[1]);
    at += 2;
    return 1;
  }
  if (end - at < 6) {
    at = end;
    return write_utf8(into.data(), replacement);
  }
  const std::uint32_t unit = code_unit(at + 2);
  at += 6;
  if (unit < 0xd800 || unit > 0xdfff) return write_utf8(into.data(), unit);
  if (unit > 0xdbff || end - at < 6 || at[0] != '\\' || at[1] != 'u') {
    return write_utf8(into.data(), replacement);
  }
  const std::uint32_t low = code_unit(at + 2);
  if (low < 0xdc00 || low > 0xdfff) return write_utf8(into.data(), replacement);
  at += 6;
  return write_utf8(into.data(), 0x10000 + ((unit - 0xd800) << 10 | (low - 0xdc00)));
}

// How many bytes the text between the quotes means.
inline std::size_t unescaped_bytes(std::string_view escaped) noexcept {
  std::size_t bytes = 0;
  const char* at = escaped.data();
  const char* const end = at + escaped.size();
  while (at != end) {
    std::array<char, 4> character;
    bytes += *at == '\\' ? take_escape(at, end, character) : (++at, 1);
  }
  return bytes;
}

// Behind the value that begins at `at`, which is not the end.
[[gnu::noinline]] inline const char* skip_value(const char* at, const char* end) noexcept {
  switch (*at) {
  case '{':
  case '[': return skip_container(at, end);
  case '"': return skip_string(at, end);
  default: return skip_scalar(at, end);
  }
}

} // namespace rowe::json
