// SPDX-License-Identifier: Apache-2.0
// Times as Foxglove's programs read them: {"sec":1,"nsec":500000000}. A type holds a time where it has a
// std::chrono time since 1970 that counts seconds or decimal parts of them, or an object of ROS's shape: two
// integers, secs and nsecs, or sec and nanosec. Such times are read in each of these forms. Durations of
// std::chrono are numbers, as they are elsewhere. Pure functions; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include <rowe/detail/schema.hpp>

#include "json/reading/numbers.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {

// Of the longest, with what digits.hpp may touch behind it.
inline constexpr std::size_t sec_nsec_bytes_max = 80;

// Whether values of this type are times since 1970.
constexpr bool is_time(const value_description& d) noexcept {
  const bool is_integer = d.kind >= value_kind::int8 && d.kind <= value_kind::uint64;
  return is_integer && d.unit.since_1970 && rowe::detail::decimals_of(d.unit) >= 0;
}

// What a time's member is called in ROS: `sec`, or `nsec`; empty: neither.
constexpr std::string_view sec_or_nsec(std::string_view name) noexcept {
  if (name == "sec" || name == "secs") return "sec";
  return name == "nsec" || name == "nsecs" || name == "nanosec" ? "nsec" : std::string_view{};
}

// Whether objects of this type are times, or durations, as ROS has them.
bool is_time(const schema_description& type) noexcept;

// Whether there is a time anywhere in it.
bool holds_time(const schema_description& type) noexcept;

// Writes a count of 10^-decimals seconds, and returns the address behind it. May touch sec_nsec_bytes_max
// bytes. Not signed: the count has 64 bits without a sign.
char* write_sec_nsec(char* at, std::int64_t count, bool is_signed, int decimals) noexcept;

// Reads such an object, or one with ROS's names, as a count of 10^-decimals seconds, rounded down; too_large:
// beyond 64 bits. Nothing: it is none, or the nanoseconds are not below a second.
std::optional<whole_number> read_sec_nsec(std::string_view validated_object, int decimals) noexcept;

// How many of its names are compared with those of its type, in a text of so many bytes: enough for a hundred
// members in any order, or for as many as fit in the type's own.
constexpr std::size_t sec_nsec_comparisons(std::size_t bytes) noexcept { return bytes / 4 + 8192; }

// Writes the JSON of a value of the type with its times in this form. What is not as the type says is copied,
// and so is what comes behind the last comparison.
void write_sec_nsec(writer& into, std::string_view validated, const schema_description& type) noexcept;

} // namespace rowe::json
