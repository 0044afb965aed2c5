// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include <rowe/types.hpp>

#include "words.hpp"

namespace rowe {
namespace {

using namespace describe_words;

template <class Integer>
std::string range() {
  return R"("minimum":)" + std::to_string(std::numeric_limits<Integer>::min()) + R"(,"maximum":)" +
         std::to_string(std::numeric_limits<Integer>::max());
}

std::string range_of(value_kind kind) {
  switch (kind) {
  case value_kind::int8: return range<std::int8_t>();
  case value_kind::int16: return range<std::int16_t>();
  case value_kind::int32: return range<std::int32_t>();
  case value_kind::int64: return range<std::int64_t>();
  case value_kind::uint8: return range<std::uint8_t>();
  case value_kind::uint16: return range<std::uint16_t>();
  case value_kind::uint32: return range<std::uint32_t>();
  default: return range<std::uint64_t>();
  }
}

template <class Range, class Write>
std::string joined(const Range& all, Write write) {
  std::string text;
  for (const auto& one : all) text += (text.empty() ? "" : ",") + write(one);
  return text;
}

std::string value_schema(const value_description& d, const member_description& m, bool is_member);

// The members of an object schema, without braces.
std::string object_schema(const schema_description& d) {
  std::string text;
  if (!d.type_name.empty()) text += R"("title":)" + quoted(d.type_name) + ",";
  text += R"("type":"object","properties":{)" + joined(d.members, [](const member_description& m) {
            return quoted(m.name) + ":" + value_schema(*m.type, m, true);
          });
  std::string required;
  for (const member_description& m : d.members) {
    if (m.type->kind != value_kind::optional) required += (required.empty() ? "" : ",") + quoted(m.name);
  }
  return text + R"(},"required":[)" + required + "]";
}

std::string integer_schema(const value_description& d, const member_description& m) {
  if (m.by_name) {
    return R"("type":"string","enum":[)" +
           joined(d.enumerators, [](const enumerator_description& e) { return quoted(e.name); }) + "]";
  }
  if (m.as_string) {
    const bool has_sign = d.kind <= value_kind::int64;
    return std::string{R"("type":"string","pattern":")"} + (has_sign ? "^-?[0-9]+$" : "^[0-9]+$") + "\"";
  }
  if (m.as_seconds) return R"("type":"number")";
  if (d.enumerators.empty()) return R"("type":"integer",)" + range_of(d.kind);
  return R"("type":"integer","oneOf":[)" +
         joined(d.enumerators,
                [&](const enumerator_description& e) {
                  return R"({"title":)" + quoted(e.name) + R"(,"const":)" + number(e.value, d.kind) + "}";
                }) +
         "]";
}

std::string array_schema(const value_description& d, const member_description& m, bool is_member) {
  const element_count count = count_of(d, is_member ? &m : nullptr);
  if (detail::is_base64(d, m)) {
    const std::string length = std::to_string((count.most + 2) / 3 * 4);
    return R"("type":"string","contentEncoding":"base64",)" +
           (count.is_fixed ? R"("minLength":)" + length + "," : "") + R"("maxLength":)" + length;
  }
  std::string text = R"("type":"array","items":)" + value_schema(*d.element, m, false);
  if (count.is_fixed) text += R"(,"minItems":)" + std::to_string(count.most);
  return text + R"(,"maxItems":)" + std::to_string(count.most);
}

// An optional member may be left out; anything else that is optional may be null.
std::string value_schema(const value_description& d, const member_description& m, bool is_member) {
  if (d.kind == value_kind::optional) {
    const std::string inside = value_schema(*d.element, m, false);
    return is_member ? inside : R"({"anyOf":[)" + inside + R"(,{"type":"null"}]})";
  }
  std::string text;
  switch (d.kind) {
  case value_kind::boolean: text = R"("type":"boolean")"; break;
  case value_kind::float32:
  case value_kind::float64: text = R"("type":"number")"; break;
  case value_kind::text: text = R"("type":"string","maxLength":)" + std::to_string(d.count_max); break;
  case value_kind::object: text = object_schema(*d.object); break;
  case value_kind::array: text = array_schema(d, m, is_member); break;
  default: text = integer_schema(d, m);
  }
  const std::string what = unit(d, m.as_seconds);
  if (!what.empty()) text += R"(,"description":)" + quoted(what);
  return "{" + text + "}";
}

} // namespace

std::string json_schema(const schema_description& type) {
  return R"({"$schema":"https://json-schema.org/draft/2020-12/schema",)" + object_schema(type) + "}";
}

} // namespace rowe
