// SPDX-License-Identifier: Apache-2.0
// The functions of rowe/json_value.hpp, on the steps of cursor.hpp. A path is followed in one pass: what
// stands before a wanted member or element is passed over, and the member itself is entered, not measured
// first.
#include <rowe/json_value.hpp>

#include "json/reading/base64.hpp"
#include "json/reading/cursor.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"
#include "json/reading/scanner.hpp"
#include "json/text/characters.hpp"

namespace rowe {
namespace {

using detail::json_bounds;
using detail::json_form;
using detail::json_outcome;
using detail::json_place;

// ---- paths ----

struct path_step {
  std::string_view name{};
  std::size_t index = 0;
  bool is_index = false;
};

// Takes `[12]` or `['name']`; `at` is behind the bracket.
bool take_bracket(std::string_view path, std::size_t& at, path_step& into) noexcept {
  if (at < path.size() && (path[at] == '\'' || path[at] == '"')) {
    const std::size_t begin = at + 1;
    const std::size_t quote = path.find(path[at], begin);
    at = std::min(quote, path.size() - 1) + 1;
    if (quote == path.npos) return false;
    into = {.name = path.substr(begin, quote - begin)};
  } else {
    const std::size_t begin = at;
    std::size_t index = 0;
    for (; at < path.size() && json::is_digit(path[at]); ++at) {
      // An array of a text has fewer elements than the largest index, which so stands for all beyond it.
      if (__builtin_mul_overflow(index, std::size_t{10}, &index) ||
          __builtin_add_overflow(index, static_cast<std::size_t>(path[at] - '0'), &index)) {
        index = SIZE_MAX / 10;
      }
    }
    if (at == begin) return false;
    into = {.index = index, .is_index = true};
  }
  if (at >= path.size() || path[at] != ']') return false;
  ++at;
  return true;
}

// Takes the step of `path` that begins at `at`, and moves `at` behind it; false: the path is wrong there.
bool take_step(std::string_view path, std::size_t& at, path_step& into) noexcept {
  if (path[at] == '[') return take_bracket(path, ++at, into);
  if (at > 0) {
    if (path[at] != '.') return false;
    ++at;
  }
  const std::size_t begin = at;
  at = std::min(path.find_first_of(".[", at), path.size());
  into = {.name = path.substr(begin, at - begin)};
  return at != begin;
}

// ---- steps in the text ----

using json::between;
using json::skip_space;

// Behind the value at `at`, and behind the comma.
const char* skip_item(const char* at, const char* end) noexcept {
  const std::string_view skipped = json::root(between(at, end)).raw;
  if (skipped.empty()) return end;
  at = skip_space(skipped.data() + skipped.size(), end);
  return at != end && *at == ',' ? skip_space(at + 1, end) : at;
}

// Takes the name at `at`, which is a quote, as it is between its quotes, and moves `at` to the value.
std::string_view take_name(const char*& at, const char* end) noexcept {
  const char* const begin = at + 1;
  const char* const quote = json::find_quote(begin, end);
  at = quote == end ? end : skip_space(quote + 1, end);
  if (at != end && *at == ':') at = skip_space(at + 1, end);
  return between(begin, quote);
}

// Where the value of the first member of this name begins; `end` if there is none. `at` is the object's
// bracket.
const char* find_member(const char* at, const char* end, std::string_view name) noexcept {
  at = skip_space(at + 1, end);
  while (at != end && *at == '"') {
    if (json::says(take_name(at, end), name)) return at;
    at = skip_item(at, end);
  }
  return end;
}

// Likewise an element; `count` becomes how many there are before it.
const char* find_element(const char* at, const char* end, std::size_t index, std::size_t& count) noexcept {
  at = skip_space(at + 1, end);
  for (count = 0; at != end && *at != ']'; ++count) {
    if (count == index) return at;
    at = skip_item(at, end);
  }
  return end;
}

json_kind kind_of(std::string_view text) noexcept {
  switch (text.empty() ? 'n' : text.front()) {
  case '{': return json_kind::object;
  case '[': return json_kind::array;
  case '"': return json_kind::string;
  case 't':
  case 'f': return json_kind::boolean;
  case 'n': return json_kind::null;
  default: return json_kind::number;
  }
}

std::string_view inside_quotes(std::string_view text) noexcept {
  return text.size() < 2 ? std::string_view{} : text.substr(1, text.size() - 2);
}

} // namespace

// ---- values ----

result<json_value> json_value::parse(std::string_view text, std::size_t depth_max) noexcept {
  if (depth_max > json::fault_depth_limit) {
    return error{errc::bad_argument, static_cast<std::int64_t>(depth_max),
                 static_cast<std::int64_t>(json::fault_depth_limit)};
  }
  const json::fault wrong = json::find_fault(text, depth_max);
  const auto at = static_cast<std::int64_t>(wrong.at);
  if (wrong.what == json::fault_kind::too_deep) {
    return error{errc::too_deep, at, static_cast<std::int64_t>(depth_max)};
  }
  if (wrong.what == json::fault_kind::malformed) return error{errc::malformed, at};
  return detail::json_access::value_of(text);
}

json_kind json_value::kind() const noexcept { return kind_of(text_); }

bool json_value::says(std::string_view text) const noexcept {
  return kind() == json_kind::string && json::says(inside_quotes(text_), text);
}

std::optional<json_value> json_value::find(std::string_view path) const noexcept {
  const json_place at = detail::json_access::follow(text_, path);
  if (at.is != json_outcome::there) return std::nullopt;
  return json_value{at.value};
}

json_range<json_member> json_value::members() const noexcept {
  return json_range<json_member>{kind() == json_kind::object ? text_.substr(1) : std::string_view{}};
}

json_range<json_value> json_value::elements() const noexcept {
  return json_range<json_value>{kind() == json_kind::array ? text_.substr(1) : std::string_view{}};
}

namespace detail {

json_value json_access::value_of(std::string_view validated) noexcept {
  constexpr std::string_view white = " \t\n\r";
  const std::size_t begin = validated.find_first_not_of(white);
  if (begin == validated.npos) return {};
  return json_value{validated.substr(begin, validated.find_last_not_of(white) + 1 - begin)};
}

json_place json_access::follow(std::string_view value, std::string_view path) noexcept {
  json_place place{.value = value};
  const char* at = value.data();
  const char* const end = at + value.size();
  std::size_t path_at = 0;
  while (path_at < path.size()) {
    path_step step;
    const std::size_t before = path_at;
    if (!take_step(path, path_at, step)) {
      return {.value = value, .is = json_outcome::bad_path, .path_bytes = path_at};
    }
    if (at == end || *at != (step.is_index ? '[' : '{')) {
      place.is = json_outcome::wrong_type;
      place.next = step.is_index ? json_form::array : json_form::object;
      place.path_bytes = before;
      break;
    }
    place.count = 0;
    at = step.is_index ? find_element(at, end, step.index, place.count) : find_member(at, end, step.name);
    if (at == end) {
      place.is = json_outcome::missing;
      place.path_bytes = path_at;
      break;
    }
  }
  // A path that is wrong is so in any text.
  for (path_step step; path_at < path.size();) {
    if (!take_step(path, path_at, step)) {
      return {.value = value, .is = json_outcome::bad_path, .path_bytes = path_at};
    }
  }
  if (place.is == json_outcome::there) place.path_bytes = path.size();
  if (place.is != json_outcome::missing && !path.empty()) place.value = json::root(between(at, end)).raw;
  return place;
}

bool json_access::read(json_place& at, bool& into) noexcept {
  into = at.value == "true";
  const bool is_boolean = kind_of(at.value) == json_kind::boolean;
  if (!is_boolean) at.is = json_outcome::wrong_type;
  return is_boolean;
}

namespace {

template <class Real>
bool read_real(json_place& at, Real& into) noexcept {
  const bool is_number = kind_of(at.value) == json_kind::number;
  if (is_number &&
      json::to_real(json::read_decimal(at.value.data(), at.value.data() + at.value.size()), into))
    return true;
  at.is = is_number ? json_outcome::out_of_range : json_outcome::wrong_type;
  return false;
}

} // namespace

bool json_access::read(json_place& at, float& into) noexcept { return read_real(at, into); }
bool json_access::read(json_place& at, double& into) noexcept { return read_real(at, into); }

bool json_access::read(json_place& at, const json_bounds& of, std::uint64_t& bits) noexcept {
  using form = json::whole_number::form;
  at.is = json_outcome::wrong_type;
  if (kind_of(at.value) != json_kind::number) return false;
  const auto n = json::to_whole(json::read_decimal(at.value.data(), at.value.data() + at.value.size()));
  if (n.what == form::fraction) return false;
  at.is = json_outcome::out_of_range;
  if (n.what == form::too_large) return false;
  const bool below_zero = n.negative && n.magnitude != 0;
  const auto least = std::uint64_t{0} - static_cast<std::uint64_t>(of.least); // its magnitude
  if (n.magnitude > (below_zero ? least : of.most)) return false;
  bits = below_zero ? std::uint64_t{0} - n.magnitude : n.magnitude;
  at.is = json_outcome::there;
  return true;
}

bool json_access::read(json_place& at, std::span<char> scratch, std::string_view& into) noexcept {
  if (kind_of(at.value) != json_kind::string) {
    at.is = json_outcome::wrong_type;
    return false;
  }
  const std::string_view escaped = inside_quotes(at.value);
  if (const auto text = json::unescape(escaped, scratch)) {
    into = *text;
    return true;
  }
  at.is = json_outcome::too_long;
  at.count = json::unescaped_bytes(escaped);
  return false;
}

// Base64, or an array of numbers.
bool json_access::read_bytes(json_place& at, const json_bounds& of, void* into, std::size_t& count) noexcept {
  auto* const bytes = static_cast<char*>(into);
  const auto fail = [&at](json_outcome why) {
    at.is = why;
    return false;
  };
  const auto fits = [&](std::size_t some) {
    at.count = count = some;
    return of.exact ? some == of.most : some <= of.most;
  };
  const json_kind is = kind_of(at.value);
  if (is == json_kind::string) {
    const json::base64_text text{inside_quotes(at.value)};
    const auto some = text.bytes();
    if (!some) return fail(json_outcome::wrong_type);
    if (!fits(*some)) return fail(json_outcome::too_long);
    return text.read(bytes) || fail(json_outcome::wrong_type);
  }
  if (is != json_kind::array) return fail(json_outcome::wrong_type);
  std::size_t elements = 0;
  json::array_walk walk{at.value};
  for (json::value one; walk.next(one); ++elements) {
    const auto number = json::to_unsigned(one);
    if (!number || *number > 255) return fail(json_outcome::wrong_type);
    if (elements < of.most) bytes[elements] = static_cast<char>(*number);
  }
  return fits(elements) || fail(json_outcome::too_long);
}

bool json_access::read_plain(json_place& at, std::string_view& into) noexcept {
  into = inside_quotes(at.value);
  const bool is_plain = kind_of(at.value) == json_kind::string && into.find('\\') == into.npos;
  if (!is_plain) at.is = json_outcome::wrong_type;
  return is_plain;
}

bool json_access::read_named(json_place& at, const json_bounds& of, std::int64_t& into) noexcept {
  if (kind_of(at.value) == json_kind::string) {
    for (const enumerator_description& one : of.names) {
      if (json::says(inside_quotes(at.value), one.name)) {
        into = one.value;
        return true;
      }
    }
  } else if (std::uint64_t bits = 0; read(at, of, bits)) {
    into = static_cast<std::int64_t>(bits);
    for (const enumerator_description& one : of.names) {
      if (one.value == into) return true;
    }
  } else if (at.is == json_outcome::wrong_type) {
    return false;
  }
  at.is = json_outcome::out_of_range;
  return false;
}

bool json_access::next(std::string_view& rest, json_value& into) noexcept {
  const char* const end = rest.data() + rest.size();
  const char* at = skip_space(rest.data(), end);
  if (at != end && *at == ',') at = skip_space(at + 1, end);
  const std::string_view item = at == end ? std::string_view{} : json::root(between(at, end)).raw;
  if (item.empty()) {
    rest = {};
    return false;
  }
  into = json_value{item};
  rest = between(item.data() + item.size(), end);
  return true;
}

bool json_access::next(std::string_view& rest, json_member& into) noexcept {
  const char* const end = rest.data() + rest.size();
  const char* at = skip_space(rest.data(), end);
  if (at != end && *at == ',') at = skip_space(at + 1, end);
  if (at != end && *at == '"') {
    const char* const name = at;
    const std::size_t name_bytes = take_name(at, end).size() + 2;
    std::string_view behind = between(at, end);
    if (at != end && next(behind, into.value)) {
      into.name = json_value{std::string_view{name, name_bytes}};
      rest = behind;
      return true;
    }
  }
  rest = {};
  return false;
}

} // namespace detail

} // namespace rowe
