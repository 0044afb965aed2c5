// SPDX-License-Identifier: Apache-2.0
// Trees from JSON text and back. Text from the program is checked by the scanner, which has the last word on
// JSON in this library and needs no memory; text from a peer was validated by the service thread.
#include "capi/object.hpp"

#include <cstdlib>
#include <cstring>

#include "capi/error.hpp"
#include "json/reading/scanner.hpp"
#include "json/writing/writer.hpp"

namespace rowe::capi {
namespace {

std::string unescaped(std::string_view escaped) {
  std::string buffer(escaped.size(), '\0');
  const auto plain = json::unescape(escaped, buffer);
  if (!plain) return {}; // of validated text it always is there: escapes are longer than what they say
  if (plain->data() != buffer.data()) return std::string{*plain};
  buffer.resize(plain->size());
  return buffer;
}

// The depth of the tree is that of the text, which was bounded when it was validated.
rowe_object tree_of_value(const json::value& from) {
  rowe_object to{from.type};
  switch (from.type) {
  case json::kind::null: break;
  case json::kind::boolean: to.truth = from.raw == "true"; break;
  case json::kind::number: to.text = from.raw; break;
  case json::kind::string: to.text = unescaped(from.raw.substr(1, from.raw.size() - 2)); break;
  case json::kind::object: {
    json::object_walk walk{from.raw};
    for (json::member m; walk.next(m);) (void)to.add(unescaped(m.name_raw), tree_of_value(m.what));
    break;
  }
  case json::kind::array: {
    json::array_walk walk{from.raw};
    for (json::value v; walk.next(v);) (void)to.add({}, tree_of_value(v));
    break;
  }
  }
  return to;
}

// At least what write() writes: six bytes for each of a string, its quotes, a comma and a colon.
std::size_t text_bytes_max(const rowe_object& value) {
  std::size_t bytes = value.text.size() * (value.type == json::kind::string ? 6 : 1) + 8;
  for (const std::string& name : value.names) bytes += name.size() * 6 + 4;
  for (const rowe_object& part : value.values) bytes += text_bytes_max(part) + 1;
  return bytes;
}

void write(json::writer& to, const rowe_object& value) {
  switch (value.type) {
  case json::kind::null: to.null(); break;
  case json::kind::boolean: to.boolean(value.truth); break;
  case json::kind::number: to.raw(value.text); break;
  case json::kind::string: to.string(value.text); break;
  case json::kind::object:
    to.begin_object();
    for (std::size_t i = 0; i < value.values.size(); ++i) {
      to.key(value.names[i]);
      write(to, value.values[i]);
    }
    to.end_object();
    break;
  case json::kind::array:
    to.begin_array();
    for (const rowe_object& part : value.values) write(to, part);
    to.end_array();
    break;
  }
}

} // namespace

rowe_object tree_of(std::string_view validated) { return tree_of_value(json::root(validated)); }

std::string text_of(const rowe_object& value) {
  std::string text(text_bytes_max(value), '\0');
  json::writer to{text};
  write(to, value);
  text.resize(to.bytes());
  return text;
}

} // namespace rowe::capi

using namespace rowe::capi;
using rowe::errc;

struct rowe_object* rowe_object_from_text(const char* text) {
  if (text == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_object* {
    const std::string_view whole{text};
    const rowe::json::fault fault = rowe::json::find_fault(whole, object_depth_max);
    if (fault.what == rowe::json::fault_kind::too_deep) {
      return no({errc::too_deep, static_cast<std::int64_t>(fault.at), object_depth_max});
    }
    if (fault.what != rowe::json::fault_kind::none) {
      return no({errc::malformed, static_cast<std::int64_t>(fault.at)});
    }
    return std::make_unique<rowe_object>(tree_of(whole)).release();
  });
}

char* rowe_object_to_text(const struct rowe_object* value) {
  if (value == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> char* {
    const std::string text = text_of(*value);
    auto* const copy = static_cast<char*>(std::malloc(text.size() + 1));
    if (copy == nullptr) return no(errc::no_memory);
    std::memcpy(copy, text.c_str(), text.size() + 1);
    return copy;
  });
}
