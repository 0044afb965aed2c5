// SPDX-License-Identifier: Apache-2.0
#include "rosmsg/wanted.hpp"

#include <algorithm>
#include <limits>

#include "json/reading/cursor.hpp"
#include "json/text/utf8.hpp"

namespace rowe::rosmsg {
namespace {

template <class Integer>
std::string whole() {
  return "a whole number from " + std::to_string(std::numeric_limits<Integer>::min()) + " to " +
         std::to_string(std::numeric_limits<Integer>::max());
}

std::string counted(std::uint32_t count, const char* of) {
  return std::to_string(count) + " " + of + (count == 1 ? "" : "s");
}

} // namespace

std::string wanted_one(const member& m) {
  switch (m.what) {
  case kind::boolean: return "true or false";
  case kind::int8: return whole<std::int8_t>();
  case kind::uint8: return whole<std::uint8_t>();
  case kind::int16: return whole<std::int16_t>();
  case kind::uint16: return whole<std::uint16_t>();
  case kind::int32: return whole<std::int32_t>();
  case kind::uint32: return whole<std::uint32_t>();
  case kind::int64: return "a whole number of 64 bits";
  case kind::uint64: return "a whole number of 64 bits that is not negative";
  case kind::float32: return "a number of single precision";
  case kind::float64: return "a number";
  case kind::text:
    return m.text_max == unbounded ? "a string" : "a string of at most " + counted(m.text_max, "byte");
  case kind::wide_text:
    return m.text_max == unbounded ? "a string" : "a string of at most " + counted(m.text_max, "unit");
  case kind::time:
  case kind::duration:
  case kind::object: break;
  }
  return "an object";
}

std::string wanted_array(const member& m) {
  const std::string what = m.is_bytes() ? "base64, or an array" : "an array";
  if (m.many == form::fixed) return what + " of " + counted(m.count, "element");
  return m.count == unbounded ? what : what + " of at most " + counted(m.count, "element");
}

std::string found_at(const char* at, const char* end) {
  constexpr std::size_t bytes_max = 48;
  const std::string_view whole =
      at == end ? std::string_view{} : json::between(at, json::skip_value(at, end));
  const std::string_view part = json::utf8_prefix(whole, bytes_max);
  std::string found{part};
  std::replace_if(found.begin(), found.end(), json::is_space, ' ');
  return part.size() < whole.size() ? found + "..." : found;
}

} // namespace rowe::rosmsg
