// SPDX-License-Identifier: Apache-2.0
// Is what the walkers find what simdjson finds? Compared value by value with its DOM and with its on-demand
// parser, two different implementations. The tests use it on texts of their own, the fuzzer on everything.
#pragma once
#ifndef SIMDJSON_EXCEPTIONS
#define SIMDJSON_EXCEPTIONS 0
#endif
#include <simdjson.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json/reading/reader.hpp"

namespace rowe::tests {

// A text's string as the walkers decode it; scratch of the size that is promised to suffice.
inline std::optional<std::string> decoded(std::string_view escaped) {
  std::string scratch(escaped.size(), '\0');
  const auto text = json::unescape(escaped, scratch);
  if (!text) return std::nullopt;
  return std::string{*text};
}

// ---- against the DOM ----

inline bool same(const json::value& ours, simdjson::dom::element theirs);

inline bool same_object(const json::value& ours, simdjson::dom::object theirs) {
  json::object_walk walk{ours.raw};
  for (const auto field : theirs) {
    json::member m;
    if (!walk.next(m) || decoded(m.name_raw) != std::string{field.key} || !json::name_is(m, field.key))
      return false;
    if (!same(m.what, field.value)) return false;
  }
  json::member none;
  return !walk.next(none) && !walk.next(none);
}

inline bool same_array(const json::value& ours, simdjson::dom::array theirs) {
  json::array_walk walk{ours.raw};
  for (const auto element : theirs) {
    json::value v;
    if (!walk.next(v) || !same(v, element)) return false;
  }
  json::value none;
  return !walk.next(none) && !walk.next(none);
}

inline bool same(const json::value& ours, simdjson::dom::element theirs) {
  using json::kind;
  using simdjson::dom::element_type;
  std::string scratch(ours.raw.size(), '\0');
  switch (theirs.type()) {
  case element_type::OBJECT:
    return ours.type == kind::object && same_object(ours, theirs.get_object().value_unsafe());
  case element_type::ARRAY:
    return ours.type == kind::array && same_array(ours, theirs.get_array().value_unsafe());
  case element_type::STRING:
    return ours.type == kind::string &&
           json::to_string(ours, scratch) == theirs.get_string().value_unsafe() &&
           json::text_is(ours, theirs.get_string().value_unsafe());
  case element_type::INT64:
    return json::to_integer(ours) == theirs.get_int64().value_unsafe() &&
           json::to_double(ours) == static_cast<double>(theirs.get_int64().value_unsafe());
  case element_type::UINT64:
    return !json::to_integer(ours) && json::to_unsigned(ours) == theirs.get_uint64().value_unsafe() &&
           json::to_double(ours) == static_cast<double>(theirs.get_uint64().value_unsafe());
  case element_type::DOUBLE:
    return !json::to_integer(ours) && json::to_double(ours) == theirs.get_double().value_unsafe();
  case element_type::BOOL: return json::to_boolean(ours) == theirs.get_bool().value_unsafe();
  case element_type::NULL_VALUE: return ours.type == kind::null && ours.raw == "null";
  }
  return false;
}

// ---- against on-demand: a full walk, every number a double ----

// What a walk of the on-demand parser finds.
enum class verdict { unknown, invalid, different, same };

template <class Theirs>
verdict compare(const json::value& ours, Theirs& theirs);

inline verdict compare_object(const json::value& ours, simdjson::ondemand::object theirs) {
  json::object_walk walk{ours.raw};
  bool equal = true;
  for (auto result : theirs) {
    simdjson::ondemand::field field;
    if (std::move(result).get(field) != simdjson::SUCCESS) return verdict::invalid;
    std::string_view key;
    if (field.unescaped_key().get(key) != simdjson::SUCCESS) return verdict::invalid;
    json::member m;
    equal = walk.next(m) && decoded(m.name_raw) == std::string{key} && equal;
    const verdict inside = compare(m.what, field.value());
    if (inside == verdict::invalid) return inside;
    equal = equal && inside == verdict::same;
  }
  json::member none;
  return equal && !walk.next(none) ? verdict::same : verdict::different;
}

inline verdict compare_array(const json::value& ours, simdjson::ondemand::array theirs) {
  json::array_walk walk{ours.raw};
  bool equal = true;
  for (auto result : theirs) {
    simdjson::ondemand::value element;
    if (std::move(result).get(element) != simdjson::SUCCESS) return verdict::invalid;
    json::value v;
    equal = walk.next(v) && equal;
    const verdict inside = compare(v, element);
    if (inside == verdict::invalid) return inside;
    equal = equal && inside == verdict::same;
  }
  json::value none;
  return equal && !walk.next(none) ? verdict::same : verdict::different;
}

// `Theirs` is a value, or the document where it is a scalar.
template <class Theirs>
verdict compare(const json::value& ours, Theirs& theirs) {
  using simdjson::ondemand::json_type;
  const auto is = [](bool equal) { return equal ? verdict::same : verdict::different; };
  json_type type;
  if (theirs.type().get(type) != simdjson::SUCCESS) return verdict::invalid;
  switch (type) {
  case json_type::object: {
    simdjson::ondemand::object object;
    if (theirs.get_object().get(object) != simdjson::SUCCESS) return verdict::invalid;
    return compare_object(ours, object);
  }
  case json_type::array: {
    simdjson::ondemand::array array;
    if (theirs.get_array().get(array) != simdjson::SUCCESS) return verdict::invalid;
    return compare_array(ours, array);
  }
  case json_type::number: {
    double x = 0;
    if (theirs.get_double().get(x) != simdjson::SUCCESS) return verdict::invalid;
    return is(json::to_double(ours) == x);
  }
  case json_type::string: {
    std::string_view text;
    if (theirs.get_string().get(text) != simdjson::SUCCESS) return verdict::invalid;
    return is(ours.type == json::kind::string && json::text_is(ours, text));
  }
  case json_type::boolean: {
    bool b = false;
    if (theirs.get_bool().get(b) != simdjson::SUCCESS) return verdict::invalid;
    return is(json::to_boolean(ours) == b);
  }
  case json_type::null: {
    bool null = false;
    if (theirs.is_null().get(null) != simdjson::SUCCESS || !null) return verdict::invalid;
    return is(ours.type == json::kind::null && ours.raw == "null");
  }
  }
  return verdict::invalid;
}

// What simdjson 3.0.1's on-demand parser gets wrong: it refuses exponents that wrap around 64 bits, even of
// zero (0e18446744073709551615); it misreads fractions below 1 with more digits than 64 bits have
// (0.1234567890123456789012345 is 1.1e-7 to it); and behind a true, false or null that is the whole text, it
// looks at the wrong byte. The DOM has none of this.
inline bool on_demand_errs(std::string_view text) {
  constexpr std::size_t digits_max = 17;
  const auto digits_from = [text](std::size_t begin) {
    return std::min(text.find_first_not_of("0123456789", begin), text.size()) - begin;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '.' && digits_from(i + 1) > digits_max) return true;
    if (text[i] != 'e' && text[i] != 'E') continue;
    const std::size_t begin = std::min(text.find_first_not_of("+-", i + 1), text.size());
    if (digits_from(begin) > digits_max) return true;
  }
  const json::value whole = json::root(text);
  return !whole.raw.empty() && (whole.type == json::kind::boolean || whole.type == json::kind::null);
}

// The whole text, with nothing behind it; unknown where that parser cannot be asked.
inline verdict compare_on_demand(std::string_view text, std::size_t capacity, std::size_t depth_max) {
  simdjson::ondemand::parser parser;
  if (parser.allocate(text.size() + 1, depth_max) != simdjson::SUCCESS) return verdict::invalid;
  simdjson::ondemand::document document;
  if (parser.iterate(text.data(), text.size(), capacity).get(document) != simdjson::SUCCESS)
    return verdict::invalid;
  if (on_demand_errs(text)) return verdict::unknown;
  const verdict found = compare(json::root(text), document);
  const bool at_end = document.current_location().error() == simdjson::OUT_OF_BOUNDS;
  return at_end ? found : verdict::invalid;
}

} // namespace rowe::tests
