// SPDX-License-Identifier: Apache-2.0
#include "described_types.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace rowe::tools {
namespace {

constexpr int type_depth_max = 32;
constexpr std::array<std::string_view, 15> kind_names{
    "boolean", "int8",    "int16",   "int32", "int64",  "uint8", "uint16",  "uint32",
    "uint64",  "float32", "float64", "text",  "object", "array", "optional"};
static_assert(static_cast<std::size_t>(value_kind::optional) == kind_names.size() - 1);

// Descriptions only ask whether there are such functions.
std::size_t some_count(const void*) noexcept { return 0; }

} // namespace

const schema_description* described_types::read(json_value type) {
  wrong_.clear();
  return read(type, 0);
}

const schema_description* described_types::read(json_value type, int depth) {
  if (const auto known = known_.find(type.text()); known != known_.end()) return known->second;
  const auto fail = [&](std::string why) -> const schema_description* {
    if (wrong_.empty()) wrong_ = std::move(why);
    return nullptr;
  };
  if (depth == type_depth_max) return fail("a type has more than 32 types inside one another");
  auto name = type.get<std::string>("type");
  const auto list = type.find("members");
  if (!name || !list) return fail("a type lacks its name or its members");
  std::vector<member_description> members;
  for (const json_value one : list->elements()) {
    member_description m;
    auto called = one.get<std::string>("name");
    if (!called) return fail("a member has no name");
    m.name = keep(*std::move(called));
    const auto says = [&](std::string_view flag) {
      const auto value = one.get<bool>(flag);
      return value && *value;
    };
    m.as_string = says("as_string");
    m.by_name = says("by_name");
    m.as_seconds = says("as_seconds");
    m.type = read_value(one, &m, depth);
    if (m.type == nullptr) return nullptr;
    members.push_back(m);
  }
  schema_description& made = types_.emplace_back();
  made.type_name = keep(*std::move(name));
  made.members = members_.emplace_back(std::move(members));
  known_.emplace(type.text(), &made);
  return &made;
}

const value_description* described_types::read_value(json_value from, member_description* owner, int depth) {
  const auto fail = [&](std::string why) -> const value_description* {
    if (wrong_.empty()) wrong_ = std::move(why);
    return nullptr;
  };
  if (depth == type_depth_max) return fail("a type has more than 32 types inside one another");
  const auto is = from.get<std::string>("is");
  const auto* const kind = is ? std::ranges::find(kind_names, *is) : kind_names.end();
  if (kind == kind_names.end()) return fail("a member has a kind that this version of rowe does not know");
  value_description d;
  d.kind = static_cast<value_kind>(kind - kind_names.begin());
  if (d.kind == value_kind::object) {
    const auto object = from.find("object");
    if (!object) return fail("a member lacks its type");
    d.object = read(*object, depth + 1);
    if (d.object == nullptr) return nullptr;
  } else if (d.kind == value_kind::array || d.kind == value_kind::optional) {
    const auto element = from.find("of");
    if (!element) return fail("an array lacks its element");
    d.element = read_value(*element, nullptr, depth + 1);
    if (d.element == nullptr) return nullptr;
  } else if (d.kind != value_kind::boolean && d.kind != value_kind::text && !read_number(from, d)) {
    return fail("an enum or a unit is not as it should be");
  }
  if (d.kind == value_kind::array || d.kind == value_kind::text) {
    const auto most = from.get<std::size_t>("most");
    if (!most) return fail("an array or a text lacks its length");
    d.count_max = *most;
  }
  if (d.kind == value_kind::array) {
    const auto fixed = from.get<bool>("fixed");
    if (!fixed) return fail("an array does not say whether its length is fixed");
    if (!*fixed) d.count = some_count;
    const auto base64 = from.get<bool>("base64");
    d.is_bytes = base64 && *base64;
    if (owner != nullptr) owner->count_limit = d.count_max;
  }
  return &values_.emplace_back(d);
}

bool described_types::read_number(json_value from, value_description& into) {
  if (const auto names = from.find("names")) {
    std::vector<enumerator_description> all;
    for (const json_value one : names->elements()) {
      auto name = one.get<std::string>("[0]");
      const auto value = one.get<std::int64_t>("[1]");
      if (!name || !value) return false;
      all.push_back({.name = keep(*std::move(name)), .value = *value});
    }
    into.enumerators = enums_.emplace_back(std::move(all));
  }
  if (const auto unit = from.find("unit")) {
    const auto numerator = unit->get<std::int64_t>("[0]");
    const auto denominator = unit->get<std::int64_t>("[1]");
    const auto since_1970 = unit->get<bool>("[2]");
    if (!numerator || !denominator || !since_1970) return false;
    into.unit = {*numerator, *denominator, *since_1970};
  }
  return true;
}

} // namespace rowe::tools
