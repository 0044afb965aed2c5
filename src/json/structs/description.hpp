// SPDX-License-Identifier: Apache-2.0
// Writes what a type with a schema looks like, for programs elsewhere that make their own declarations of it.
// A type is {"type":"nav_msgs/Odometry","members":[...]}; the type's name may be empty. A member has a "name"
// and a value: "is" (the kind, as value_kind calls it), and what this kind needs:
//
//   numbers       "names": [["moving",1],...] of an enum, "unit": [1,1000,false] as in unit_description
//   text          "most": bytes
//   array         "most": elements, "fixed": whether it always has as many, "of": the value of an element,
//                 "base64": true where it is text
//   optional      "of": the value
//   object        "object": the type
//
// Flags of a member that are true: "as_string", "by_name", "as_seconds". Nothing waits or allocates.
#pragma once
#include <span>

#include <rowe/schema.hpp>

#include "json/writing/writer.hpp"

namespace rowe::json {

// How many elements an array has: exactly so many, or at most.
struct array_count {
  std::size_t most = 0;
  bool fixed = false;
};
// `owner`: the member that is the array; null where the array lies in another value.
array_count count_of(const value_description& array, const member_description* owner) noexcept;

// No object has a shorter JSON text: what is missing is left out, texts and lists are empty, numbers have one
// digit.
std::size_t shortest_text(const schema_description& type) noexcept;

// The member "names" of an enum; nothing if there are none.
void write_names(writer& into, std::span<const enumerator_description> all) noexcept;
void write_description(writer& into, const schema_description& type) noexcept;

} // namespace rowe::json
