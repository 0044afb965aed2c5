// SPDX-License-Identifier: Apache-2.0
// JSON text in place, for C loops: nothing here allocates.
#include <rowe/loop.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <span>
#include <string_view>

#include <rowe/json_value.hpp>

#include "capi/error.hpp"
#include "capi/outside.hpp"
#include "json/reading/base64.hpp"
#include "json/writing/writer.hpp"

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
    case rowe_type_bytes: {
      const auto* const bytes = static_cast<const char*>(va_arg(from, const void*));
      const std::size_t count = va_arg(from, std::size_t);
      if ((bytes == nullptr && count != 0) || !capi::is_size(count)) return false;
      to.raw("\"");
      for (std::size_t done = 0; done < count;) { // in pieces, each but the last one of whole threes
        std::array<char, 256> text;
        const std::size_t some = std::min(count - done, text.size() / 4 * 3);
        const char* const end = json::write_base64(text.data(), bytes + done, some);
        to.append({text.data(), static_cast<std::size_t>(end - text.data())});
        done += some;
      }
      to.append("\"");
      break;
    }
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

// In C the text is what the caller says it is, so nothing relies on it being JSON.
json_value value_of(const char* text, std::size_t bytes) noexcept {
  return detail::json_access::value_of({text, bytes});
}

template <class T>
int read_at(const char* text, std::size_t bytes, const char* path, T* into) noexcept {
  if (text == nullptr || path == nullptr || into == nullptr || !capi::is_size(bytes))
    return rowe_error_misuse;
  const auto read = value_of(text, bytes).get<T>(path);
  if (!read) return capi::number_of(read.code());
  *into = *read;
  return rowe_ok;
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

int rowe_read_int64(const char* text, size_t bytes, const char* path, int64_t* into) {
  return read_at(text, bytes, path, into);
}

int rowe_read_double(const char* text, size_t bytes, const char* path, double* into) {
  return read_at(text, bytes, path, into);
}

int rowe_read_boolean(const char* text, size_t bytes, const char* path, bool* into) {
  return read_at(text, bytes, path, into);
}

int rowe_read_string(const char* text, size_t bytes, const char* path, char* buffer, size_t buffer_bytes) {
  if (text == nullptr || path == nullptr || buffer == nullptr || !capi::is_size(bytes))
    return rowe_error_misuse;
  const std::size_t room = buffer_bytes == 0 ? 0 : buffer_bytes - 1;
  const auto read = value_of(text, bytes).get<std::string_view>(path, std::span<char>{buffer, room});
  if (!read && read.code() != errc::too_long) return capi::number_of(read.code());
  if (!read || read->size() >= buffer_bytes) {
    if (buffer_bytes != 0) buffer[0] = '\0'; // a part of it may stand there
    return rowe_error_too_long;
  }
  if (read->data() != buffer) read->copy(buffer, read->size());
  buffer[read->size()] = '\0';
  return rowe_ok;
}
