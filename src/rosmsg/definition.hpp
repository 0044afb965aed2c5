// SPDX-License-Identifier: Apache-2.0
// A message type with all types inside of it, as its definition says. Made once (parse.hpp), then read by any
// number of threads. What a definition can make grow has a bound here, because anybody may have written it.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <rowe/ros_type.hpp>

namespace rowe::rosmsg {

inline constexpr std::size_t definition_bytes_max = 1 << 20;
inline constexpr std::size_t types_max = 1024;
inline constexpr std::size_t members_max = 1024;         // of one type
inline constexpr std::size_t all_members_max = 16 << 10; // of all types
inline constexpr std::size_t name_bytes_max = 255;       // of a member, a type, a package
inline constexpr std::size_t default_bytes_max = 16 << 10;
inline constexpr std::size_t depth_max = 32; // types within types
// What a message may have whose sequences are empty.
inline constexpr std::uint64_t least_objects_max = 1 << 20;
inline constexpr std::uint64_t least_bytes_max = 1 << 28;
inline constexpr std::uint32_t unbounded = std::numeric_limits<std::uint32_t>::max();

enum class kind : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  text,
  wide_text, // UTF-16
  time,      // two integers of 32 bits
  duration,
  object,
};

enum class form : std::uint8_t { one, fixed, sequence };

struct member {
  std::string name;
  std::string key; // in JSON: the name with what stands before and behind it
  kind what = kind::boolean;
  form many = form::one;
  std::uint32_t count = unbounded;    // fixed: its elements; sequence: the most that it may have
  std::uint32_t text_max = unbounded; // of a text: bytes; of a wide one: units
  std::uint32_t object = 0;           // its type, by its place in the definition
  std::string default_json;           // empty: zeros
  std::uint32_t line = 0;             // of the definition
  std::string type_name;              // as written there; of kind::object only

  // Written as base64.
  bool is_bytes() const noexcept { return what == kind::uint8 && many != form::one; }
};

enum class wire : std::uint8_t { ros1, cdr };

struct type {
  std::string name;
  std::vector<member> members;
  std::vector<std::uint16_t> by_name;       // places of the members, in the order of their names
  std::array<std::uint64_t, 2> bytes_min{}; // of a value, by `wire`; without padding
  std::uint64_t objects = 0;                // in a value whose arrays are empty, itself included
  std::size_t depth = 0;                    // types within types, itself included; 0: not known yet

  std::uint64_t least(wire in) const noexcept { return bytes_min[static_cast<std::size_t>(in)]; }
};

struct definition {
  ros_version version = ros_version::ros1;
  std::vector<type> types; // the first one is the message
};

// How many bytes a value takes at least, or exactly if it is a number; 0: an object.
constexpr std::size_t bytes_of(kind what) noexcept {
  switch (what) {
  case kind::boolean:
  case kind::int8:
  case kind::uint8: return 1;
  case kind::int16:
  case kind::uint16: return 2;
  case kind::int32:
  case kind::uint32:
  case kind::float32:
  case kind::text:
  case kind::wide_text: return 4;
  case kind::int64:
  case kind::uint64:
  case kind::float64:
  case kind::time:
  case kind::duration: return 8;
  case kind::object: break;
  }
  return 0;
}

} // namespace rowe::rosmsg
