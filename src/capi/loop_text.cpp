// SPDX-License-Identifier: Apache-2.0
// JSON text in place, for C loops: nothing here allocates.
#include <rowe/loop.h>

#include <cmath>
#include <cstdarg>
#include <span>
#include <string_view>

#include "capi/error.hpp"
#include "json/reader.hpp"
#include "json/writer.hpp"

using namespace rowe;

namespace {

// Writes the members that follow `key`; false when one has no type.
bool write_members(json::writer& to, const char* key, std::va_list& from) noexcept {
  for (; key != nullptr; key = va_arg(from, const char*)) {
    to.key(key);
    switch (va_arg(from, int)) {
    case rowe_type_null: to.null(); break;
    case rowe_type_boolean: to.boolean(va_arg(from, int) != 0); break; // a bool is passed as int
    case rowe_type_int: to.number(va_arg(from, int)); break;
    case rowe_type_int64: to.number(va_arg(from, std::int64_t)); break;
    case rowe_type_double: to.number(va_arg(from, double)); break;
    case rowe_type_string:
      if (const char* const text = va_arg(from, const char*)) {
        to.string(text);
        break;
      }
      return false;
    case rowe_type_object:
    case rowe_type_array:
      if (const char* const text = va_arg(from, const char*)) {
        to.raw(text);
        break;
      }
      return false;
    default: return false;
    }
  }
  return true;
}

// The member's value, looked for from the start of the text.
result<json::value> member_of(const char* text, std::size_t bytes, const char* key) noexcept {
  if (text == nullptr || key == nullptr) return errc::misuse;
  const json::value object = json::root({text, bytes});
  if (object.type != json::kind::object) return errc::wrong_type;
  const auto member = json::find(object.raw, key);
  if (!member) return errc::missing_member;
  return *member;
}

// Hands the member to `read`, which returns a number of enum rowe_error.
template <class Read>
int read_member(const char* text, std::size_t bytes, const char* key, const void* into,
                Read&& read) noexcept {
  if (into == nullptr) return rowe_error_misuse;
  const auto member = member_of(text, bytes, key);
  return member ? read(*member) : capi::number_of(member.code());
}

} // namespace

size_t rowe_write(char* buffer, size_t buffer_bytes, const char* key, ...) {
  if (buffer == nullptr || buffer_bytes == 0) return 0;
  json::writer to{std::span<char>{buffer, buffer_bytes - 1}};
  std::va_list from;
  va_start(from, key);
  to.begin_object();
  const bool typed = write_members(to, key, from);
  to.end_object();
  va_end(from);
  const std::size_t bytes = typed && !to.overflowed() ? to.bytes() : 0;
  buffer[bytes] = '\0';
  return bytes;
}

int rowe_read_int64(const char* text, size_t bytes, const char* key, int64_t* into) {
  return read_member(text, bytes, key, into, [&](const json::value& v) -> int {
    const bool whole = v.type == json::kind::number && v.raw.find_first_of(".eE") == std::string_view::npos;
    if (!whole) return rowe_error_wrong_type;
    const auto number = json::to_integer(v);
    if (!number) return rowe_error_out_of_range;
    *into = *number;
    return rowe_ok;
  });
}

int rowe_read_double(const char* text, size_t bytes, const char* key, double* into) {
  return read_member(text, bytes, key, into, [&](const json::value& v) -> int {
    const auto number = json::to_double(v);
    if (!number) return rowe_error_wrong_type;
    *into = *number;
    return rowe_ok;
  });
}

int rowe_read_boolean(const char* text, size_t bytes, const char* key, bool* into) {
  return read_member(text, bytes, key, into, [&](const json::value& v) -> int {
    const auto truth = json::to_boolean(v);
    if (!truth) return rowe_error_wrong_type;
    *into = *truth;
    return rowe_ok;
  });
}

int rowe_read_string(const char* text, size_t bytes, const char* key, char* buffer, size_t buffer_bytes) {
  return read_member(text, bytes, key, buffer, [&](const json::value& v) -> int {
    if (v.type != json::kind::string) return rowe_error_wrong_type;
    if (buffer_bytes == 0) return rowe_error_too_long;
    const auto plain = json::to_string(v, {buffer, buffer_bytes - 1});
    if (!plain || plain->size() >= buffer_bytes) {
      buffer[0] = '\0'; // a part of it may stand there
      return rowe_error_too_long;
    }
    if (plain->data() != buffer) plain->copy(buffer, plain->size());
    buffer[plain->size()] = '\0';
    return rowe_ok;
  });
}
