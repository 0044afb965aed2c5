// SPDX-License-Identifier: Apache-2.0
#include "json/structs/description.hpp"

#include <array>
#include <string_view>

#include <rowe/detail/schema.hpp>

#include "json/reading/base64.hpp"

namespace rowe::json {
namespace {

constexpr std::array<std::string_view, 15> kinds{"boolean", "int8",   "int16",  "int32",  "int64",
                                                 "uint8",   "uint16", "uint32", "uint64", "float32",
                                                 "float64", "text",   "object", "array",  "optional"};
static_assert(static_cast<std::size_t>(value_kind::optional) == kinds.size() - 1);

void flag(writer& into, std::string_view name, bool given) noexcept {
  if (!given) return;
  into.member(name, true);
}

void write_number(writer& into, const value_description& d) noexcept {
  write_names(into, d.enumerators);
  if (d.unit.denominator == 0) return;
  into.begin_array("unit");
  into.number(d.unit.numerator);
  into.number(d.unit.denominator);
  into.boolean(d.unit.since_1970);
  into.end_array();
}

// `outermost`: it is the member itself.
void write_value(writer& into, const value_description& d, const member_description& owner,
                 bool outermost) noexcept {
  into.member("is", kinds[static_cast<std::size_t>(d.kind)]);
  switch (d.kind) {
  case value_kind::boolean: break;
  case value_kind::text: into.member("most", d.count_max); break;
  case value_kind::object:
    into.key("object");
    write_description(into, *d.object);
    break;
  case value_kind::array: {
    const array_count count = count_of(d, outermost ? &owner : nullptr);
    into.member("most", count.most);
    into.member("fixed", count.fixed);
    flag(into, "base64", rowe::detail::is_base64(d, owner));
    [[fallthrough]];
  }
  case value_kind::optional:
    into.begin_object("of");
    write_value(into, *d.element, owner, false);
    into.end_object();
    break;
  default: write_number(into, d);
  }
}

std::size_t shortest_value(const value_description& d, const member_description& owner,
                           bool outermost) noexcept {
  switch (d.kind) {
  case value_kind::text: return 2;
  case value_kind::object: return shortest_text(*d.object);
  case value_kind::optional: return 0;
  case value_kind::boolean: return 4;
  case value_kind::array: {
    const array_count count = count_of(d, outermost ? &owner : nullptr);
    if (!count.fixed || count.most == 0) return 2;
    if (d.is_bytes && !owner.as_numbers) return 2 + base64_text_bytes(count.most);
    return 2 + count.most * (shortest_value(*d.element, owner, false) + 1) - 1;
  }
  default: return 1;
  }
}

} // namespace

array_count count_of(const value_description& array, const member_description* owner) noexcept {
  if (owner != nullptr && owner->count != nullptr) return {owner->count_limit, false};
  return {array.count_max, array.count == nullptr};
}

void write_names(writer& into, std::span<const enumerator_description> all) noexcept {
  if (all.empty()) return;
  into.begin_array("names");
  for (const enumerator_description& e : all) {
    into.begin_array();
    into.string(e.name);
    into.number(e.value);
    into.end_array();
  }
  into.end_array();
}

void write_description(writer& into, const schema_description& type) noexcept {
  into.begin_object();
  into.member("type", type.type_name);
  into.begin_array("members");
  for (const member_description& m : type.members) {
    into.begin_object();
    into.member("name", m.name);
    write_value(into, *m.type, m, true);
    flag(into, "as_string", m.as_string);
    flag(into, "by_name", m.by_name);
    flag(into, "as_seconds", m.as_seconds);
    into.end_object();
  }
  into.end_array();
  into.end_object();
}

std::size_t shortest_text(const schema_description& type) noexcept {
  std::size_t bytes = 2;
  std::size_t members = 0;
  for (const member_description& one : type.members) {
    if (one.type->kind == value_kind::optional) continue;
    bytes += (members++ == 0 ? 0 : 1) + one.name.size() + 3 + shortest_value(*one.type, one, true);
  }
  return bytes;
}

} // namespace rowe::json
