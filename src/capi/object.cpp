// SPDX-License-Identifier: Apache-2.0
// What a C program asks of a value.
#include "capi/object.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "capi/error.hpp"

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

// What was asked is a value of another type, or none: then rowe_get() or rowe_at() found nothing.
int wrong(const rowe_object* value) noexcept {
  return fail(value == nullptr ? errc::missing_member : errc::wrong_type);
}

template <class Integer>
int as_integer(const rowe_object* value, Integer* into) noexcept {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::number) return wrong(value);
  if (value->text.find_first_of(".eE") != std::string::npos) return fail(errc::wrong_type);
  const auto whole = rowe::json::to_integer(number_in(*value));
  if (!whole || !std::in_range<Integer>(*whole)) return fail(errc::out_of_range);
  *into = static_cast<Integer>(*whole);
  return rowe_ok;
}

} // namespace

void rowe_object_free(struct rowe_object* object) { delete object; }

int rowe_type_of(const struct rowe_object* value) {
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

const struct rowe_object* rowe_get(const struct rowe_object* object, const char* key) {
  if (object == nullptr || key == nullptr) return no(errc::misuse);
  if (object->type != kind::object) return no(errc::wrong_type);
  const std::size_t at = object->find(key);
  if (at == object->names.size()) return no(errc::missing_member);
  return &object->values[at];
}

const struct rowe_object* rowe_at(const struct rowe_object* object, size_t index) {
  if (object == nullptr) return no(errc::misuse);
  if (object->type != kind::object && object->type != kind::array) return no(errc::wrong_type);
  if (index >= object->values.size()) {
    return no({errc::missing_member, static_cast<std::int64_t>(index),
               static_cast<std::int64_t>(object->values.size())});
  }
  return &object->values[index];
}

const char* rowe_key_at(const struct rowe_object* object, size_t index) {
  if (object == nullptr) return no(errc::misuse);
  if (object->type != kind::object) return no(errc::wrong_type);
  if (rowe_at(object, index) == nullptr) return nullptr;
  return object->names[index].c_str();
}

size_t rowe_count(const struct rowe_object* object) { return object == nullptr ? 0 : object->values.size(); }

const char* rowe_as_string(const struct rowe_object* value) {
  if (value == nullptr || value->type != kind::string) {
    wrong(value);
    return nullptr;
  }
  return value->text.c_str();
}

size_t rowe_string_bytes(const struct rowe_object* value) {
  return value != nullptr && value->type == kind::string ? value->text.size() : 0;
}

int rowe_as_int(const struct rowe_object* value, int* into) { return as_integer(value, into); }
int rowe_as_int64(const struct rowe_object* value, int64_t* into) { return as_integer(value, into); }

int rowe_as_double(const struct rowe_object* value, double* into) {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::number) return wrong(value);
  *into = rowe::json::to_double(number_in(*value)).value_or(std::numeric_limits<double>::quiet_NaN());
  return rowe_ok;
}

int rowe_as_boolean(const struct rowe_object* value, bool* into) {
  if (into == nullptr) return fail(errc::misuse);
  if (value == nullptr || value->type != kind::boolean) return wrong(value);
  *into = value->truth;
  return rowe_ok;
}

const char* rowe_get_string(const struct rowe_object* object, const char* key) {
  const rowe_object* const value = rowe_get(object, key);
  return value == nullptr ? nullptr : rowe_as_string(value);
}
int rowe_get_int(const struct rowe_object* object, const char* key, int* into) {
  const rowe_object* const value = rowe_get(object, key);
  return value == nullptr ? rowe_last_error() : rowe_as_int(value, into);
}
int rowe_get_int64(const struct rowe_object* object, const char* key, int64_t* into) {
  const rowe_object* const value = rowe_get(object, key);
  return value == nullptr ? rowe_last_error() : rowe_as_int64(value, into);
}
int rowe_get_double(const struct rowe_object* object, const char* key, double* into) {
  const rowe_object* const value = rowe_get(object, key);
  return value == nullptr ? rowe_last_error() : rowe_as_double(value, into);
}
int rowe_get_boolean(const struct rowe_object* object, const char* key, bool* into) {
  const rowe_object* const value = rowe_get(object, key);
  return value == nullptr ? rowe_last_error() : rowe_as_boolean(value, into);
}
