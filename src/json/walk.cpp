// SPDX-License-Identifier: Apache-2.0
// The lazy half of reader.hpp: a cursor that finds its way through text that is known to be JSON by looking
// at brackets, quotes and commas only. It never checks what validate() has checked, but every step looks at
// `end` first and moves forward, so that on any other text it stays inside and ends.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>

#include "block.hpp"
#include "fault.hpp"
#include "reader.hpp"
#include "utf8.hpp"

namespace rowe::json {
namespace {

std::string_view between(const char* begin, const char* end) noexcept {
  return {begin, static_cast<std::size_t>(end - begin)};
}

// Between the tokens of a valid text, what is not above a space is white space.
bool is_space(char c) noexcept { return static_cast<std::uint8_t>(c) <= ' '; }

const char* skip_space(const char* at, const char* end) noexcept {
  while (at != end && is_space(*at)) ++at;
  return at;
}

// From behind the opening quote to the closing one; `end` when there is none.
const char* find_quote(const char* at, const char* end) noexcept {
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
const char* skip_string(const char* at, const char* end) noexcept {
  const char* const quote = find_quote(at + 1, end);
  return quote == end ? end : quote + 1;
}

// Finds the bracket that closes the one it begins at. 32 bytes a step; bytes inside strings are told by
// counting quotes, and a stretch with a backslash in it, which may hide quotes, is looked at byte by byte.
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
  // Up to `stop`, or one byte further where an escape begins before it. True when the bracket is found; at_
  // is behind it then.
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

const char* skip_container(const char* at, const char* end) noexcept { return container_end{at, end}.find(); }

// To the comma, bracket or white space behind a number or a word.
const char* skip_scalar(const char* at, const char* end) noexcept {
  for (; end - at >= block::bytes; at += block::bytes) {
    const block b{at};
    const std::uint32_t marks = b.equal(',') | b.equal_but_for_bit_5('}') | b.at_most(' ');
    if (marks != 0) return at + std::countr_zero(marks);
  }
  return std::find_if(at, end, [](char c) { return c == ',' || c == '}' || c == ']' || is_space(c); });
}

// The value that begins at `at`, which is before `end`; `at` moves behind it. False where no value begins.
bool take_value(const char*& at, const char* end, value& into) noexcept {
  const char* const begin = at;
  kind type{};
  switch (*at) {
  case '{':
    type = kind::object;
    at = skip_container(at, end);
    break;
  case '[':
    type = kind::array;
    at = skip_container(at, end);
    break;
  case '"':
    type = kind::string;
    at = skip_string(at, end);
    break;
  case 't':
  case 'f':
    type = kind::boolean;
    at = skip_scalar(at, end);
    break;
  case 'n':
    type = kind::null;
    at = skip_scalar(at, end);
    break;
  default:
    if (*at != '-' && (*at < '0' || *at > '9')) return false;
    type = kind::number;
    at = skip_scalar(at, end);
    break;
  }
  into = {type, between(begin, at)};
  return true;
}

// Where the inside of a container that opens with `bracket` begins; `end` when the text is no such container.
const char* enter(std::string_view text, char bracket) noexcept {
  const char* const end = text.data() + text.size();
  const char* const at = skip_space(text.data(), end);
  return at != end && *at == bracket ? at + 1 : end;
}

// To the next name or element, over the comma before it.
const char* skip_comma(const char* at, const char* end) noexcept {
  at = skip_space(at, end);
  if (at != end && *at == ',') at = skip_space(at + 1, end);
  return at;
}

// ---- escapes ----

std::uint32_t hex_value(char c) noexcept {
  return static_cast<std::uint32_t>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10) & 15;
}

std::uint32_t code_unit(const char* four) noexcept {
  return hex_value(four[0]) << 12 | hex_value(four[1]) << 8 | hex_value(four[2]) << 4 | hex_value(four[3]);
}

char unescaped(char c) noexcept {
  switch (c) {
  case 'b': return '\b';
  case 'f': return '\f';
  case 'n': return '\n';
  case 'r': return '\r';
  case 't': return '\t';
  default: return c; // a quote, a slash or a backslash
  }
}

// The character that an escape stands for, at `at` (a backslash), which moves behind it; the bytes written.
// What only text that was not validated has, an unpaired surrogate or an escape that is cut off, is U+FFFD.
std::size_t take_escape(const char*& at, const char* end, std::span<char, 4> into) noexcept {
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

bool has_escape(std::string_view escaped) noexcept { return escaped.find('\\') != std::string_view::npos; }

std::string_view inside_quotes(const value& v) noexcept {
  return v.raw.size() < 2 ? std::string_view{} : v.raw.substr(1, v.raw.size() - 2);
}

template <class Integer>
std::optional<Integer> whole_number(const value& v) noexcept {
  if (v.type != kind::number) return std::nullopt;
  Integer x = 0;
  const char* const end = v.raw.data() + v.raw.size();
  const auto read = std::from_chars(v.raw.data(), end, x);
  if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
  return x;
}

} // namespace

value root(std::string_view validated) noexcept {
  const char* const end = validated.data() + validated.size();
  const char* at = skip_space(validated.data(), end);
  value v;
  if (at != end) take_value(at, end, v);
  return v;
}

object_walk::object_walk(std::string_view validated_object) noexcept
    : at_{enter(validated_object, '{')}, end_{validated_object.data() + validated_object.size()} {}

bool object_walk::next(member& into) noexcept {
  member found;
  at_ = skip_comma(at_, end_);
  if (at_ != end_ && *at_ == '"') {
    const char* const name = at_ + 1;
    const char* const quote = find_quote(name, end_);
    found.name_raw = between(name, quote);
    at_ = quote == end_ ? end_ : skip_space(quote + 1, end_);
    if (at_ != end_ && *at_ == ':') at_ = skip_space(at_ + 1, end_);
    if (at_ != end_ && take_value(at_, end_, found.what)) {
      into = found;
      return true;
    }
  }
  at_ = end_;
  return false;
}

array_walk::array_walk(std::string_view validated_array) noexcept
    : at_{enter(validated_array, '[')}, end_{validated_array.data() + validated_array.size()} {}

bool array_walk::next(value& into) noexcept {
  at_ = skip_comma(at_, end_);
  if (at_ != end_ && take_value(at_, end_, into)) return true;
  at_ = end_;
  return false;
}

bool says_by_escapes(std::string_view escaped, std::string_view plain) noexcept {
  if (!has_escape(escaped)) return false;
  const char* at = escaped.data();
  const char* const end = at + escaped.size();
  while (at != end) {
    std::array<char, 4> character{*at};
    const std::size_t bytes = *at == '\\' ? take_escape(at, end, character) : (++at, 1);
    if (!plain.starts_with(std::string_view{character.data(), bytes})) return false;
    plain.remove_prefix(bytes);
  }
  return plain.empty();
}

std::optional<value> find(std::string_view validated_object, std::string_view name) noexcept {
  object_walk members{validated_object};
  for (member m; members.next(m);) {
    if (name_is(m, name)) return m.what;
  }
  return std::nullopt;
}

std::optional<std::string_view> unescape(std::string_view escaped, std::span<char> scratch) noexcept {
  if (!has_escape(escaped)) return escaped;
  const char* at = escaped.data();
  const char* const end = at + escaped.size();
  char* into = scratch.data();
  char* const limit = into + scratch.size();
  while (at != end) {
    const char* const backslash = std::find(at, end, '\\');
    if (backslash - at > limit - into) return std::nullopt;
    into = std::copy(at, backslash, into);
    at = backslash;
    if (at == end) break;
    std::array<char, 4> character;
    const std::size_t bytes = take_escape(at, end, character);
    if (bytes > static_cast<std::size_t>(limit - into)) return std::nullopt;
    into = std::copy_n(character.data(), bytes, into);
  }
  return between(scratch.data(), into);
}

std::optional<std::string_view> to_string(const value& v, std::span<char> scratch) noexcept {
  if (v.type != kind::string) return std::nullopt;
  return unescape(inside_quotes(v), scratch);
}

std::optional<double> to_double(const value& v) noexcept {
  if (v.type != kind::number) return std::nullopt;
  return nearest_double(v.raw);
}

std::optional<std::int64_t> to_integer(const value& v) noexcept { return whole_number<std::int64_t>(v); }
std::optional<std::uint64_t> to_unsigned(const value& v) noexcept { return whole_number<std::uint64_t>(v); }

std::optional<bool> to_boolean(const value& v) noexcept {
  if (v.type != kind::boolean) return std::nullopt;
  return v.raw == "true";
}

} // namespace rowe::json
