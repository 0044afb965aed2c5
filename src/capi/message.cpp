// SPDX-License-Identifier: Apache-2.0
// Values from C's variable arguments: a type, then a value of the C type that rowe.h names for it.
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <span>

#include "capi/error.hpp"
#include "capi/object.hpp"
#include "capi/outside.hpp"
#include "wire/text/utf8.hpp"
#include "json/reading/base64.hpp"
#include "json/writing/writer.hpp"

namespace rowe::capi {
namespace {

bool is_utf8(std::string_view text) noexcept { return wire::is_utf8(std::as_bytes(std::span{text})); }

template <class Number>
rowe_object number(Number x) {
  char buffer[64]; // the longest number has 25 bytes
  json::writer to{buffer};
  to.number(x);
  rowe_object value{json::kind::number};
  value.text = to.text();
  return value;
}

// A C program's arguments behind the last named one, which C++ can pass on only by address.
struct arguments {
  std::va_list list;
};

result<rowe_object> nested(const rowe_object* value, json::kind announced) {
  if (value == nullptr) return errc::misuse;
  if (value->type != announced) return errc::wrong_type;
  return value->copy();
}

// The next value, announced as `type`.
result<rowe_object> take(int type, arguments& from) {
  switch (type) {
  case rowe_type_null: return rowe_object{};
  case rowe_type_boolean: {
    rowe_object value{json::kind::boolean};
    value.truth = va_arg(from.list, int) != 0; // a bool is passed as int
    return value;
  }
  case rowe_type_int: return number(va_arg(from.list, int));
  case rowe_type_int64: return number(va_arg(from.list, std::int64_t));
  case rowe_type_double: {
    const double x = va_arg(from.list, double);
    if (!std::isfinite(x)) return errc::out_of_range;
    return number(x);
  }
  case rowe_type_string: {
    const char* const text = va_arg(from.list, const char*);
    if (text == nullptr) return errc::misuse;
    if (!is_utf8(text)) return errc::malformed;
    rowe_object value{json::kind::string};
    value.text = text;
    return value;
  }
  case rowe_type_bytes: {
    const auto* const bytes = static_cast<const char*>(va_arg(from.list, const void*));
    const std::size_t count = va_arg(from.list, std::size_t);
    if (bytes == nullptr && count != 0) return errc::misuse;
    if (!is_size(json::base64_text_bytes(std::min(count, json::base64_bytes_max))))
      return error{errc::out_of_range, static_cast<std::int64_t>(count), PTRDIFF_MAX / 4 * 3};
    rowe_object value{json::kind::string};
    value.text.resize(json::base64_text_bytes(count));
    json::write_base64(value.text.data(), bytes, count);
    return value;
  }
  case rowe_type_object: return nested(va_arg(from.list, const rowe_object*), json::kind::object);
  case rowe_type_array: return nested(va_arg(from.list, const rowe_object*), json::kind::array);
  default: return error{errc::wrong_type, type};
  }
}

// An object of all members from `key` to the NULL.
result<rowe_object> take_members(const char* key, arguments& from) {
  rowe_object object{json::kind::object};
  for (; key != nullptr; key = va_arg(from.list, const char*)) {
    if (!is_utf8(key)) return errc::malformed;
    if (object.find(key) != object.names.size()) return errc::duplicate_member;
    result<rowe_object> value = take(va_arg(from.list, int), from);
    if (!value) return value.error();
    if (const status added = object.add(key, std::move(*value)); !added) return added.error();
  }
  return object;
}

int append(rowe_object* array, int type, arguments& from) {
  if (array == nullptr) return fail(errc::misuse);
  if (array->type != json::kind::array) return fail(errc::wrong_type);
  result<rowe_object> value = take(type, from);
  if (!value) return fail(value.error());
  return done(array->add({}, std::move(*value)));
}

int set(rowe_object* object, const char* key, int type, arguments& from) {
  if (object == nullptr || key == nullptr) return fail(errc::misuse);
  if (object->type != json::kind::object) return fail(errc::wrong_type);
  if (!is_utf8(key)) return fail(errc::malformed);
  result<rowe_object> value = take(type, from);
  if (!value) return fail(value.error());
  return done(object->set(key, std::move(*value)));
}

} // namespace
} // namespace rowe::capi

using namespace rowe::capi;
using rowe::errc;

struct rowe_object* rowe_message(const char* key, ...) {
  arguments from;
  va_start(from.list, key);
  rowe_object* const made = pointer_with_memory([&]() -> rowe_object* {
    rowe::result<rowe_object> object = take_members(key, from);
    if (!object) return no(object.error());
    return std::make_unique<rowe_object>(std::move(*object)).release();
  });
  va_end(from.list);
  return made;
}

struct rowe_object* rowe_object_new_array(void) {
  return pointer_with_memory([] { return std::make_unique<rowe_object>(rowe::json::kind::array).release(); });
}

int rowe_object_append(struct rowe_object* array, int type, ...) {
  arguments from;
  va_start(from.list, type);
  const int code = code_with_memory([&] { return append(array, type, from); });
  va_end(from.list);
  return code;
}

int rowe_object_set(struct rowe_object* object, const char* key, int type, ...) {
  arguments from;
  va_start(from.list, type);
  const int code = code_with_memory([&] { return set(object, key, type, from); });
  va_end(from.list);
  return code;
}
