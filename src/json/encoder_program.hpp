// SPDX-License-Identifier: Apache-2.0
// The program that a schema is flattened into: an array of steps, and the literals that they write. A step
// writes its literal, then its value. Where the value is made of values that repeat or may be missing, the
// steps of their body follow, with offsets counted from the element; so the program is a tree, laid flat in
// the order of the text.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "encoder.hpp"

namespace rowe::json {

// Literals are copied in chunks of this size, and padded so that the last chunk may be.
inline constexpr std::size_t literal_chunk_bytes = 16;

enum class operation : std::uint8_t {
  // clang-format off
  boolean, int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64,  // as value_kind
  // clang-format on
  text,
  scalars, // an array of one of the first row, which `element` names
  repeat,  // an array of anything else
  perhaps, // an optional
  nothing, // the literal was all
};

struct encoder::step {
  std::uint32_t literal = 0; // index of its first byte
  std::uint32_t literal_bytes = 0;
  std::uint32_t offset = 0;   // of the value, or of an array's first element
  std::uint32_t argument = 0; // offset of what the function takes
  std::uint32_t count = 0;    // of an array's elements; with a function, the most there can be
  std::uint32_t stride = 0;   // from element to element
  std::uint32_t body = 0;     // steps that follow and belong to this one
  operation what = operation::nothing;
  operation element = operation::nothing;
  std::int8_t decimals = -1;
  bool as_string = false;
  bool else_null = false;       // a missing optional is null, else nothing at all
  bool comma_if_needed = false; // before the literal: whether a member precedes it is not known in advance
  std::size_t (*count_of)(const void*) noexcept = nullptr;
  const void* (*engaged)(const void*) noexcept = nullptr;
  std::string_view (*text_of)(const void*) noexcept = nullptr;
};

} // namespace rowe::json
