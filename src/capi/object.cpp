// SPDX-License-Identifier: Apache-2.0
// What a C program asks of a value.
#include "capi/object.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <utility>

#include "capi/error.hpp"
#include "wire/text/text_out.hpp"
#include "json/reading/base64.hpp"

using namespace rowe::capi;
using rowe::errc;
using rowe::error;
using kind = rowe::json::kind;

rowe_object rowe_object::copy() const {
  rowe_object other{type};
  other.truth = truth;
  other.depth = depth;
  other.text = text;
  other.names = names;
  other.values.reserve(values.size());
  for (const rowe_object& value : values) other.values.push_back(value.copy());
  return other;
}

std::size_t rowe_object::find(std::string_view name) const noexcept {
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

namespace {

rowe::status may_hold(const rowe_object& value) noexcept {
  if (value.depth < object_depth_max) return {};
  return error{errc::too_deep, static_cast<std::int64_t>(value.depth) + 1, object_depth_max};
}

} // namespace

rowe::status rowe_object::add(std::string_view name, rowe_object value) {
  if (const rowe::status may = may_hold(value); !may) return may;
  values.reserve(std::bit_ceil(values.size() + 1)); // now, so that names and values stay of one length
  if (type == kind::object) names.emplace_back(name);
  depth = std::max(depth, value.depth + 1);
  values.push_back(std::move(value));
  return {};
}

rowe::status rowe_object::set(std::string_view name, rowe_object value) {
  const std::size_t at = find(name);
  if (at == names.size()) return add(name, std::move(value));
  if (const rowe::status may = may_hold(value); !may) return may;
  depth = std::max(depth, value.depth + 1); // what it replaces may have been deeper: a bound is enough
  values[at] = std::move(value);
  return {};
}

namespace {

rowe::json::value number_in(const rowe_object& value) noexcept { return {kind::number, value.text}; }

// ---- diagnostics of accessors

// No diagnostic here is longer.
using words = rowe::wire::text_of<256>;

// Begins one of a member: its name, which may be long.
rowe::wire::text_out& add_member(words& to, const char* key) noexcept {
  return key == nullptr ? to : to.add("the member \"").add_shortened(key, 64).add("\": ");
}

std::string_view name_of(kind of) noexcept {
  switch (of) {
  case kind::null: return "null";
  case kind::boolean: return "a boolean";
  case kind::number: return "a number";
  case kind::string: return "a string";
  case kind::object: return "an object";
  case kind::array: return "an array";
  }
  return "";
}

// What was asked is a value of another type, or none: then rowe_object_get() or rowe_object_at() found
// nothing. `key`: the member it is; null where that is not known.
int wrong(const rowe_object* value, const char* key, std::string_view wanted) noexcept {
  if (value == nullptr) return fail(errc::missing_member, "there is no value (NULL)");
  words why;
  add_member(why, key).add(wanted).add(" is wanted, it is ").add(name_of(value->type));
  return fail(errc::wrong_type, why.text());
}

std::nullptr_t no_container(const rowe_object& value, std::string_view wanted) noexcept {
  wrong(&value, nullptr, wanted);
  return nullptr;
}

template <class Integer>
int as_integer(const rowe_object* value, Integer* into, const char* key = nullptr) noexcept {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::number) return wrong(value, key, "a whole number");
  words why;
  add_member(why, key);
  const std::string_view token = std::string_view{value->text}.substr(0, 64);
  if (value->text.find_first_of(".eE") != std::string::npos)
    return fail(errc::wrong_type, why.add("a whole number is wanted, it is ").add(token).text());
  const auto whole = rowe::json::to_integer(number_in(*value));
  if (!whole || !std::in_range<Integer>(*whole)) {
    why.add(token).add(sizeof(Integer) == sizeof(std::int64_t) ? " has more than 64 bits"
                                                               : " has more than 32 bits");
    return fail(errc::out_of_range, why.text());
  }
  *into = static_cast<Integer>(*whole);
  return rowe_ok;
}

const char* as_string(const rowe_object* value, const char* key = nullptr) noexcept {
  if (value != nullptr && value->type == kind::string) return value->text.c_str();
  wrong(value, key, "a string");
  return nullptr;
}

int as_double(const rowe_object* value, double* into, const char* key = nullptr) noexcept {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::number) return wrong(value, key, "a number");
  *into = rowe::json::to_double(number_in(*value)).value_or(std::numeric_limits<double>::quiet_NaN());
  return rowe_ok;
}

int as_boolean(const rowe_object* value, bool* into, const char* key = nullptr) noexcept {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::boolean) return wrong(value, key, "a boolean");
  *into = value->truth;
  return rowe_ok;
}

int as_bytes(const rowe_object* value, void* into, std::size_t size, std::size_t* count,
             const char* key = nullptr) noexcept {
  if (into == nullptr && size != 0) return fail(errc::misuse);
  constexpr std::string_view wanted = "base64, or an array of numbers from 0 to 255,";
  const bool is_text = value != nullptr && value->type == kind::string;
  if (!is_text && (value == nullptr || value->type != kind::array)) return wrong(value, key, wanted);
  const auto is_none = [&] {
    words why;
    return fail(errc::wrong_type, add_member(why, key).add(wanted).add(" is wanted").text());
  };
  const rowe::json::base64_text text{is_text ? std::string_view{value->text} : std::string_view{}};
  const bool escapes = is_text && value->text.find('\\') != std::string::npos; // its own are resolved
  const auto bytes = is_text ? text.bytes() : std::optional{value->values.size()};
  if (!bytes || escapes) return is_none();
  if (*bytes > size)
    return fail({errc::too_long, static_cast<std::int64_t>(*bytes), static_cast<std::int64_t>(size)});
  if (is_text && !text.read(static_cast<char*>(into))) return is_none();
  for (std::size_t i = 0; !is_text && i < *bytes; ++i) {
    const rowe_object& one = value->values[i];
    const auto number = one.type == kind::number ? rowe::json::to_unsigned(number_in(one)) : std::nullopt;
    if (!number || *number > 255) return is_none();
    static_cast<unsigned char*>(into)[i] = static_cast<unsigned char>(*number);
  }
  if (count != nullptr) *count = *bytes;
  return rowe_ok;
}

} // namespace

void rowe_object_free(struct rowe_object* object) { delete object; }

int rowe_object_type_of(const struct rowe_object* value) {
  if (value == nullptr) return -1;
  switch (value->type) {
  case kind::null: return rowe_type_null;
  case kind::boolean: return rowe_type_boolean;
  case kind::string: return rowe_type_string;
  case kind::object: return rowe_type_object;
  case kind::array: return rowe_type_array;
  case kind::number: break;
  }
  const auto whole = rowe::json::to_integer(number_in(*value));
  if (!whole) return rowe_type_double;
  return std::in_range<int>(*whole) ? rowe_type_int : rowe_type_int64;
}

const struct rowe_object* rowe_object_get(const struct rowe_object* object, const char* key) {
  if (object == nullptr || key == nullptr) return no(errc::misuse);
  if (object->type != kind::object) return no_container(*object, "an object");
  const std::size_t at = object->find(key);
  if (at == object->names.size()) {
    words why;
    return no(errc::missing_member, add_member(why, key).add("the object has none of this name").text());
  }
  return &object->values[at];
}

const struct rowe_object* rowe_object_at(const struct rowe_object* object, size_t index) {
  if (object == nullptr) return no(errc::misuse);
  if (object->type != kind::object && object->type != kind::array)
    return no_container(*object, "an object or array");
  if (index >= object->values.size()) {
    words why;
    why.add("the index is ").add(index).add(", and there are ").add(object->values.size());
    return no({errc::missing_member, static_cast<std::int64_t>(index),
               static_cast<std::int64_t>(object->values.size())},
              why.text());
  }
  return &object->values[index];
}

const char* rowe_object_key_at(const struct rowe_object* object, size_t index) {
  if (object == nullptr) return no(errc::misuse);
  if (object->type != kind::object) return no_container(*object, "an object");
  if (rowe_object_at(object, index) == nullptr) return nullptr;
  return object->names[index].c_str();
}

size_t rowe_object_count(const struct rowe_object* object) {
  return object == nullptr ? 0 : object->values.size();
}

const char* rowe_object_as_string(const struct rowe_object* value) { return as_string(value); }

size_t rowe_object_string_bytes(const struct rowe_object* value) {
  return value != nullptr && value->type == kind::string ? value->text.size() : 0;
}

int rowe_object_as_int(const struct rowe_object* value, int* into) { return as_integer(value, into); }
int rowe_object_as_int64(const struct rowe_object* value, int64_t* into) { return as_integer(value, into); }
int rowe_object_as_double(const struct rowe_object* value, double* into) { return as_double(value, into); }
int rowe_object_as_boolean(const struct rowe_object* value, bool* into) { return as_boolean(value, into); }
int rowe_object_as_bytes(const struct rowe_object* value, void* into, size_t size, size_t* count) {
  return as_bytes(value, into, size, count);
}

const char* rowe_object_get_string(const struct rowe_object* object, const char* key) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? nullptr : as_string(value, key);
}
int rowe_object_get_int(const struct rowe_object* object, const char* key, int* into) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? rowe_last_error() : as_integer(value, into, key);
}
int rowe_object_get_int64(const struct rowe_object* object, const char* key, int64_t* into) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? rowe_last_error() : as_integer(value, into, key);
}
int rowe_object_get_double(const struct rowe_object* object, const char* key, double* into) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? rowe_last_error() : as_double(value, into, key);
}
int rowe_object_get_boolean(const struct rowe_object* object, const char* key, bool* into) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? rowe_last_error() : as_boolean(value, into, key);
}
int rowe_object_get_bytes(const struct rowe_object* object, const char* key, void* into, size_t size,
                          size_t* count) {
  const rowe_object* const value = rowe_object_get(object, key);
  return value == nullptr ? rowe_last_error() : as_bytes(value, into, size, count, key);
}
