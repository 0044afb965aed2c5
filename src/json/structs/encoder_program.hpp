// SPDX-License-Identifier: Apache-2.0
// The program of a flattened schema: an array of steps, and the literals that they write. A step writes its
// literal, then its value. If the value consists of values that repeat or may be missing, the steps of their
// body follow, with offsets from the element. So the program is a tree, flattened in the order of the text.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "json/structs/encoder.hpp"
#include "json/structs/times.hpp"
#include "json/text/digits.hpp"

namespace rowe::json {

// Literals are copied in chunks of this size, and padded so that the last chunk may be.
inline constexpr std::size_t literal_chunk_bytes = 16;
// Returns where it ends. At `at` there must be space for whole chunks. Most literals are one.
inline char* copy_chunks(const char* from, std::size_t bytes, char* at) noexcept {
  std::memcpy(at, from, literal_chunk_bytes);
  for (std::size_t i = literal_chunk_bytes; i < bytes; i += literal_chunk_bytes) {
    std::memcpy(at + i, from + i, literal_chunk_bytes);
  }
  return at + bytes;
}

enum class operation : std::uint8_t {
  // Scalars.
  // clang-format off
  boolean, int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64,  // as value_kind
  // clang-format on
  in_quotes, // the integer `plain`, as a string
  rounded_float32,
  rounded_float64, // to `decimals`
  seconds,         // the integer `plain`, with `decimals` digits behind the point
  sec_nsec,        // the same, as {"sec","nsec"}
  // Everything else.
  text,
  c_text,  // chars up to a '\0', at most `count` of them
  named,   // the integer `plain`, by the name that it has
  scalars, // an array of the scalar `element`
  base64,  // bytes, between quotes that are literals
  repeat,  // an array of anything else
  perhaps, // an optional
  comma,   // if the object has a member so far
  nothing, // the literal was all
};

// Room for a scalar to be written in place: a number in quotes, or a time.
inline constexpr std::size_t scalar_buffer_bytes = std::max(number_buffer_bytes + 2, sec_nsec_bytes_max);

constexpr bool is_scalar(operation o) noexcept { return o < operation::text; }

struct encoder::step {
  std::uint32_t literal = 0; // index of its first byte
  std::uint32_t literal_bytes = 0;
  std::uint32_t offset = 0;   // of the value, or of an array's first element
  std::uint32_t argument = 0; // offset of what the function takes; of named: index of its first name
  std::uint32_t count = 0;    // of an array's elements; with a function, the most there can be; of names
  std::uint32_t stride = 0;   // from element to element
  std::uint32_t body = 0;     // steps that follow and belong to this one
  std::uint32_t doubles = 0;  // float64 steps in a row: this one and all that follow, be it beyond the body
  std::uint32_t ample_bytes = 0; // room in which these can be written without another look at it
  operation what = operation::nothing;
  operation element = operation::nothing;
  operation plain = operation::nothing;
  std::int8_t decimals = 0;
  bool else_null = false; // a missing optional is null, else nothing at all
  std::size_t (*count_of)(const void*) noexcept = nullptr;
  const void* (*engaged)(const void*) noexcept = nullptr;
  std::string_view (*text_of)(const void*) noexcept = nullptr;
};

inline std::string_view c_text(const char* at, std::size_t bytes_max) noexcept {
  const auto* const end = static_cast<const char*>(std::memchr(at, '\0', bytes_max));
  return {at, end == nullptr ? bytes_max : static_cast<std::size_t>(end - at)};
}

// A value of an enum and the literal that is its name, in quotes. Those of one enum are sorted by value.
struct encoder::name {
  std::int64_t value = 0;
  std::uint32_t literal = 0;
  std::uint32_t literal_bytes = 0;
};

} // namespace rowe::json
