// SPDX-License-Identifier: Apache-2.0
#include "service/parameters/parameter_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "service/base/service_limits.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/description.hpp"
#include "json/text/utf8.hpp"

namespace rowe::service {
namespace {

using detail::parameter_description;
using detail::parameter_kind;
using detail::parameter_value;

template <class T>
bool is_between(const parameter_description& what, const parameter_value& value) noexcept {
  const T number = value.number<T>();
  return number >= what.least.number<T>() && number <= what.most.number<T>(); // false for NaN
}

const enumerator_description* find_name(const parameter_description& what, std::int64_t value) noexcept {
  const auto found = std::find_if(what.names.begin(), what.names.end(),
                                  [value](const enumerator_description& one) { return one.value == value; });
  return found == what.names.end() ? nullptr : &*found;
}

// A whole number of JSON as 64 bits; false: it is none, or too large for the type.
bool read_whole(const json::value& from, bool natural, parameter_value& into) noexcept {
  if (from.type != json::kind::number) return false;
  const json::whole_number read =
      json::to_whole(json::read_decimal(from.raw.data(), from.raw.data() + from.raw.size()));
  if (read.what != json::whole_number::form::whole) return false;
  if (natural) {
    if (read.negative && read.magnitude != 0) return false;
    into = parameter_value::of_number(read.magnitude);
    return true;
  }
  constexpr std::uint64_t beyond = std::uint64_t{1} << 63;
  if (read.magnitude > beyond - (read.negative ? 0 : 1)) return false;
  into = parameter_value::of_number(
      static_cast<std::int64_t>(read.negative ? ~read.magnitude + 1 : read.magnitude));
  return true;
}

bool read_text(const parameter_description& what, const json::value& from, parameter_value& into) noexcept {
  std::array<char, detail::parameter_text_bytes_max> plain;
  const auto text = json::to_string(from, plain);
  if (!text || text->size() > what.text_bytes_max) return false;
  into = parameter_value::of_text(*text);
  return true;
}

bool read_choice(const parameter_description& what, const json::value& from, parameter_value& into) noexcept {
  if (read_whole(from, false, into)) return find_name(what, into.number<std::int64_t>()) != nullptr;
  for (const enumerator_description& one : what.names) {
    if (!json::text_is(from, one.name)) continue;
    into = parameter_value::of_number(one.value);
    return true;
  }
  return false;
}

bool read(const parameter_description& what, const json::value& from, parameter_value& into) noexcept {
  switch (what.kind) {
  case parameter_kind::boolean: {
    const auto said = json::to_boolean(from);
    if (said) into = parameter_value::of_number(std::uint64_t{*said});
    return said.has_value();
  }
  case parameter_kind::integer: return read_whole(from, false, into) && is_allowed(what, into);
  case parameter_kind::natural: return read_whole(from, true, into) && is_allowed(what, into);
  case parameter_kind::real: {
    const auto number = json::to_double(from);
    if (number) into = parameter_value::of_number(*number);
    return number && is_allowed(what, into);
  }
  case parameter_kind::text: return read_text(what, from, into);
  case parameter_kind::choice: return read_choice(what, from, into);
  }
  return false;
}

void add_json(wire::text_out& into, const parameter_description& what,
              const parameter_value& value) noexcept {
  std::array<char, 64> buffer;
  json::writer out{buffer};
  write_value(what, value, out);
  into.add({buffer.data(), out.bytes()});
}

void add_wanted(wire::text_out& into, const parameter_description& what) noexcept {
  switch (what.kind) {
  case parameter_kind::boolean: into.add("true or false is wanted"); return;
  case parameter_kind::text:
    into.add("a text of at most ").add(what.text_bytes_max).add(" bytes is wanted");
    return;
  case parameter_kind::choice:
    into.add("one of ");
    for (std::size_t i = 0; i < what.names.size(); ++i)
      into.add(i == 0 ? "" : ", ").add_shortened(what.names[i].name, parameter_name_bytes_shown);
    into.add(" is wanted");
    return;
  case parameter_kind::integer:
  case parameter_kind::natural:
  case parameter_kind::real:
    into.add(what.kind == parameter_kind::real ? "a number" : "a whole number").add(" from ");
    add_json(into, what, what.least);
    into.add(" to ");
    add_json(into, what, what.most);
    into.add(" is wanted");
  }
}

std::string_view number_word(const parameter_description& what) noexcept {
  if (what.kind == parameter_kind::integer) return "int64";
  if (what.kind == parameter_kind::natural) return "uint64";
  return what.single ? "float32" : "float64";
}

// The lowest and the largest value of a real number's type bound nothing that a person types.
bool bounds(const parameter_description& what, const parameter_value& value) noexcept {
  if (what.kind != parameter_kind::real) return true;
  const double at = std::abs(value.number<double>());
  const double all = what.single ? static_cast<double>((std::numeric_limits<float>::max)())
                                 : (std::numeric_limits<double>::max)();
  return at < all;
}

void write_bound(json::writer& into, std::string_view name, const parameter_description& what,
                 const parameter_value& value) noexcept {
  if (!bounds(what, value)) return;
  into.key(name);
  write_value(what, value, into);
}

} // namespace

bool is_allowed(const parameter_description& what, const parameter_value& value) noexcept {
  switch (what.kind) {
  case parameter_kind::integer: return is_between<std::int64_t>(what, value);
  case parameter_kind::natural: return is_between<std::uint64_t>(what, value);
  case parameter_kind::real: return is_between<double>(what, value);
  case parameter_kind::choice: return find_name(what, value.number<std::int64_t>()) != nullptr;
  case parameter_kind::boolean:
  case parameter_kind::text: break;
  }
  return true;
}

bool read_value(const parameter_description& what, std::string_view json, parameter_value& into,
                wire::text_out& why) noexcept {
  const json::value from = json::root(json);
  parameter_value found;
  if (read(what, from, found)) {
    into = found;
    return true;
  }
  why.add("it is ").add_shortened(from.raw, parameter_value_bytes_shown).add("; ");
  add_wanted(why, what);
  return false;
}

void write_value(const parameter_description& what, const parameter_value& value,
                 json::writer& into) noexcept {
  switch (what.kind) {
  case parameter_kind::boolean: return into.boolean(value.number<std::uint64_t>() != 0);
  case parameter_kind::integer: return into.number(value.number<std::int64_t>());
  case parameter_kind::natural: return into.number(value.number<std::uint64_t>());
  case parameter_kind::real:
    if (what.single) return into.number(static_cast<float>(value.number<double>()));
    return into.number(value.number<double>());
  case parameter_kind::text: return into.string(value.text());
  case parameter_kind::choice:
    if (const auto* const named = find_name(what, value.number<std::int64_t>()))
      return into.string(named->name);
    return into.number(value.number<std::int64_t>());
  }
}

void write_description(const parameter_description& what, json::writer& into) noexcept {
  into.begin_object();
  switch (what.kind) {
  case parameter_kind::boolean: into.member("is", "boolean"); break;
  case parameter_kind::text:
    into.member("is", "text");
    into.member("most", what.text_bytes_max);
    break;
  case parameter_kind::choice:
    into.member("is", "int64");
    json::write_names(into, what.names);
    into.member("by_name", true);
    break;
  case parameter_kind::integer:
  case parameter_kind::natural:
  case parameter_kind::real:
    into.member("is", number_word(what));
    write_bound(into, "least", what, what.least);
    write_bound(into, "most", what, what.most);
  }
  into.end_object();
}

} // namespace rowe::service
