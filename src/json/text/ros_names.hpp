// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

#include <rowe/schema.hpp>

namespace rowe::json {

// The type of ROS in which a member's text, number or boolean is written; empty for objects, arrays and
// optional ones. Pure; any thread.
constexpr std::string_view ros_scalar_name(const value_description& d, const member_description& m) noexcept {
  if (d.kind >= value_kind::int8 && d.kind <= value_kind::uint64) {
    if (m.as_string || m.by_name) return "string";
    if (m.as_seconds) return "float64";
  }
  switch (d.kind) {
  case value_kind::boolean: return "bool";
  case value_kind::int8: return "int8";
  case value_kind::int16: return "int16";
  case value_kind::int32: return "int32";
  case value_kind::int64: return "int64";
  case value_kind::uint8: return "uint8";
  case value_kind::uint16: return "uint16";
  case value_kind::uint32: return "uint32";
  case value_kind::uint64: return "uint64";
  case value_kind::float32: return "float32";
  case value_kind::float64: return "float64";
  case value_kind::text: return "string";
  default: return {};
  }
}

} // namespace rowe::json
