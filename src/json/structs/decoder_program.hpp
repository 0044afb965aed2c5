// SPDX-License-Identifier: Apache-2.0
// A schema, flattened for reading: a tree of steps, one for each value that can occur, and for each object a
// table to look up its members. A step's offsets are counted from the object or element that it is part of.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "json/structs/decoder.hpp"
#include "json/text/bytes.hpp"

namespace rowe::json {

struct decoder::step {
  value_kind what{};
  bool as_string = false;    // an integer: may stand in quotes
  std::int8_t decimals = -1; // an integer: so many digits behind the point of seconds; -1: as it is
  std::int8_t time_decimals =
      -1;                 // a time since 1970, which may be {"sec","nsec"}: those of its unit; -1: none
  bool unused = false;    // a counting member, which its array sets: read, and forgotten
  bool all_of_it = false; // an array of exactly `count` elements
  bool base64 = false;    // an array of bytes: may be text
  std::uint32_t offset = 0;
  std::uint32_t elements_offset = 0; // array: of its first element
  std::uint32_t stride = 0;          // array: from element to element
  std::uint32_t count_offset = 0;    // counted array: of what the functions of its count take
  std::size_t count = 0;             // array, text: what it holds; the member of a name: its value's bits
  const step* element = nullptr;     // array, optional
  const shape* object = nullptr;     // object; an integer by name: members that are named as the values are
  bool (*resize)(void* array, std::size_t count) noexcept = nullptr;
  void (*set_count)(void* object, std::size_t count) noexcept = nullptr;    // counted array
  std::size_t (*count_of)(const void* object) noexcept = nullptr;           // the same
  char* (*resize_text)(void* string, std::size_t bytes) noexcept = nullptr; // null: chars up to a '\0'
  void* (*emplace)(void* optional) noexcept = nullptr;
  void (*reset)(void* optional) noexcept = nullptr;

  // Arrays: whether one counting member counts both.
  bool counted_as(const step& other) const noexcept {
    return count_of == other.count_of && count_offset == other.count_offset;
  }
};

// A name, its first sixteen bytes ready to be compared at once.
struct decoder::member {
  static constexpr std::size_t head_bytes = 16;

  std::uint64_t head[2]{};      // of the name and the quote behind it
  std::uint64_t mask[2]{};      // which of its bits count
  const char* name = nullptr;   // with the quote behind it
  std::uint32_t name_bytes = 0; // without
  std::uint32_t hash = 0;
  std::uint32_t number = 0;   // from 1, in the order in which the schema is read
  std::uint32_t index = 0;    // in its shape: of two names of one member, that of the first
  bool plain = false;         // is written in JSON as it is
  bool shares_count = false;  // one counting member counts several arrays, this one among them
  bool keeps_default = false; // where it is missing; else an optional is emptied, and others are required
  step value;

  std::string_view view() const noexcept { return {name, name_bytes}; }
};

struct decoder::shape {
  static constexpr std::size_t words_max = members_max / 64;

  const member* members = nullptr;
  std::uint32_t count = 0; // of members; behind them stand `names - count` that are members by another name
  std::uint32_t names = 0;
  std::uint32_t slot_mask = 0;
  const std::uint16_t* slots = nullptr; // by hash: 1 + index of a plain member; 0: none. Never full
  std::array<std::uint64_t, words_max>
      required{}; // one bit a member, as in the masks of those that were seen
};

// The hash of a name as it is written. Names are few and known beforehand, so any mixing is good enough. If
// an attacker makes names collide, each costs comparisons with no more names than are in a row in the table.
inline std::uint32_t name_hash(std::string_view name) noexcept {
  constexpr std::uint64_t odd = 0x9e37'79b9'7f4a'7c15; // 2^64 by the golden ratio
  std::uint64_t hash = name.size() * odd;
  const auto mix = [&hash](std::uint64_t word) {
    hash = (hash ^ word) * odd;
    hash ^= hash >> 32;
  };
  for (; name.size() >= 8; name.remove_prefix(8)) mix(load_eight(name.data()));
  if (!name.empty()) mix(load_fewer(name.data(), name.size()));
  return static_cast<std::uint32_t>(hash);
}

} // namespace rowe::json
