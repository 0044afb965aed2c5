// SPDX-License-Identifier: Apache-2.0
// The JSON Schema of a type as Foxglove's programs read it, inside of a JSON string. They know less of JSON
// Schema than validators do: one `type` for each value, no alternatives, no arrays of arrays. So the schema
// says that an optional value is there, and that an array inside of an array is an object of unknown members.
// Panels still show what comes. Nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>

#include <rowe/schema.hpp>

#include "json/writing/writer.hpp"

namespace rowe::wire {

// How times are described: those of topics' messages as the objects that they become
// (json/structs/times.hpp), those of calls as they are.
enum class foxglove_times : std::uint8_t { as_described, sec_nsec };

// Writes the string, with its quotes. Null: an object of which nothing is known.
void write_foxglove_schema(json::writer& into, const schema_description* type, foxglove_times times) noexcept;

// How many bytes that takes.
std::size_t foxglove_schema_bytes(const schema_description* type, foxglove_times times) noexcept;

} // namespace rowe::wire
