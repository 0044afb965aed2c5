// SPDX-License-Identifier: Apache-2.0
// The lazy half of reader.hpp, made of the steps in cursor.hpp.
#include <algorithm>
#include <array>
#include <charconv>

#include "json/reading/cursor.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"

namespace rowe::json {
namespace {

// Takes the value that begins at `at`, which is before `end`, and moves `at` behind it. False if no value
// begins there.
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

bool has_escape(std::string_view escaped) noexcept { return escaped.find('\\') != std::string_view::npos; }

std::string_view inside_quotes(const value& v) noexcept {
  return v.raw.size() < 2 ? std::string_view{} : v.raw.substr(1, v.raw.size() - 2);
}

template <class Integer>
std::optional<Integer> integer_in(const value& v) noexcept {
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

object_walk::object_walk(const document& validated_object) noexcept
    : indexed_{validated_object.indexed.data()},
      indexed_end_{indexed_ + validated_object.indexed.size()},
      at_{indexed_ == indexed_end_ ? enter(validated_object.text, '{') : validated_object.behind_index},
      end_{validated_object.text.data() + validated_object.text.size()} {}

bool object_walk::find_next(member& into) noexcept {
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

std::optional<value> find(const document& validated_object, std::string_view name) noexcept {
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

std::string_view unescape_some(std::string_view& escaped, std::span<char> scratch) noexcept {
  assert(scratch.size() >= 4);
  const char* at = escaped.data();
  const char* const end = at + escaped.size();
  char* into = scratch.data();
  char* const limit = into + scratch.size();
  while (at != end && limit - into >= 4) {
    const char* const plain_end = at + std::min(end - at, limit - into);
    const char* const backslash = std::find(at, plain_end, '\\');
    into = std::copy(at, backslash, into);
    at = backslash;
    if (at == plain_end || limit - into < 4) continue;
    std::array<char, 4> character;
    const std::size_t bytes = take_escape(at, end, character);
    into = std::copy_n(character.data(), bytes, into);
  }
  escaped.remove_prefix(static_cast<std::size_t>(at - escaped.data()));
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

std::optional<std::int64_t> to_integer(const value& v) noexcept { return integer_in<std::int64_t>(v); }
std::optional<std::uint64_t> to_unsigned(const value& v) noexcept { return integer_in<std::uint64_t>(v); }

std::optional<bool> to_boolean(const value& v) noexcept {
  if (v.type != kind::boolean) return std::nullopt;
  return v.raw == "true";
}

} // namespace rowe::json
