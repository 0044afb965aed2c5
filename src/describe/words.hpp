// SPDX-License-Identifier: Apache-2.0
// Pieces that several descriptions need. For set-up: they allocate.
#pragma once
#include <string>
#include <string_view>

#include <rowe/detail/schema.hpp>

namespace rowe::describe_words {

// A JSON string, with its quotes; TypeScript reads it as well.
std::string quoted(std::string_view text);

// May it stand as a name in C, ROS and TypeScript: ASCII letters, digits and underscores, no digit first?
bool is_name(std::string_view text) noexcept;

bool is_integer(value_kind kind) noexcept;

// An enumerator's value as its enum has it, which `kind` says.
std::string number(std::int64_t value, value_kind kind);

// "milliseconds", "seconds since 1970", "units of 1/30 seconds"; empty if the number is no time.
std::string unit(const value_description& value, bool as_seconds);

// An array's elements: as many, or up to as many.
struct element_count {
  std::size_t most = 0;
  bool is_fixed = false;
};
element_count count_of(const value_description& array, const member_description* counted) noexcept;

} // namespace rowe::describe_words
