// SPDX-License-Identifier: Apache-2.0
// The spellings of one name. ROS resolves "odom" to "/odom", and ROS 2 writes "geometry_msgs/msg/Twist" where
// ROS 1 writes "geometry_msgs/Twist". Both spellings name the same thing. Also how long one is in JSON. Pure
// functions.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "wire/codec/own_names.hpp"

namespace rowe::service {

// The length of a text in JSON, with its escapes.
constexpr std::size_t bytes_in_json(std::string_view text) noexcept {
  std::size_t bytes = 0;
  for (const char c : text) bytes += c == '"' || c == '\\' ? 2 : static_cast<unsigned char>(c) < ' ' ? 6 : 1;
  return bytes;
}

// FNV-1a, 64 bits (Fowler, Noll, Vo): short names, no key, no allocation.
constexpr std::uint64_t hash_of(std::string_view text) noexcept {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

using wire::has_slash;
using wire::is_of_rosapi;
using wire::is_own_name;
using wire::without_slash;

// The parts of a type: PACKAGE/NAME or PACKAGE/KIND/NAME, where the kind is msg, srv or action. Any other
// text is a name only.
struct type_parts {
  std::string_view package;
  std::string_view kind;
  std::string_view name;
};
constexpr type_parts parts_of_type(std::string_view type) noexcept {
  const std::size_t first = type.find('/');
  const std::size_t last = type.rfind('/');
  if (first == std::string_view::npos || first == 0) return {{}, {}, type};
  if (first == last) return {type.substr(0, first), {}, type.substr(first + 1)};
  const std::string_view kind = type.substr(first + 1, last - first - 1);
  if (kind != "msg" && kind != "srv" && kind != "action") return {{}, {}, type};
  return {type.substr(0, first), kind, type.substr(last + 1)};
}

constexpr bool same_type(std::string_view a, std::string_view b) noexcept {
  if (a == b) return true;
  const type_parts left = parts_of_type(a);
  const type_parts right = parts_of_type(b);
  const bool same_kind = left.kind == right.kind || left.kind.empty() || right.kind.empty();
  return same_kind && left.name == right.name && left.package == right.package;
}
// A hash that is the same for both spellings of a type; 0 if there is no type.
constexpr std::uint32_t hash_of_type(std::string_view type) noexcept {
  if (type.empty()) return 0;
  const type_parts parts = parts_of_type(type);
  return static_cast<std::uint32_t>(hash_of(parts.package) * 31 ^ hash_of(parts.name)) | 1U;
}

} // namespace rowe::service
