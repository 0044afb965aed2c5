// SPDX-License-Identifier: Apache-2.0
// Reads the values in a rosbridge envelope, of the kinds that several members share. For rosbridge.cpp only;
// the texts are validated, nothing waits or allocates. Each function returns why the value is refused;
// nothing if it is right, and then `into` has it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "wire/rosbridge/rosbridge.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::rosbridge {

// Is the value a string that says the word, in either case?
bool is_word(const json::value& v, std::string_view word) noexcept;

// An integer from 0 to `most`.
std::optional<refusal> read_count(std::string_view member, const json::value& v, std::int64_t most,
                                  std::int64_t& into) noexcept;

// Milliseconds; below 0 is none, as for the reference server, and leaves `into` alone.
std::optional<refusal> read_throttle(const json::value& v, std::int64_t& into) noexcept;

// From `least` on; the refusal of one that is negative says so, too. One that is larger than `into` can hold
// becomes the largest.
std::optional<refusal> read_at_least(std::string_view member, const json::value& v, std::int64_t least,
                                     std::uint32_t& into) noexcept;

// Reads the members that only a fragment has. The reference server writes a total with a fraction, which is
// rounded down, and is not exact.
std::optional<refusal> read_fragment(const json::document& text, request& into) noexcept;

// Reads a number of seconds, into nanoseconds, at least 1; unlimited if it is 0 or 64 bits cannot hold it.
std::optional<refusal> read_timeout(std::string_view member, const json::value& v,
                                    std::int64_t& into) noexcept;

// Reads seconds, {"secs":…,"nsecs":…}, or "infinite", into nanoseconds; unlimited if it has no end or 64 bits
// cannot hold it.
std::optional<refusal> read_duration(std::string_view member, const json::value& v,
                                     std::int64_t& into) noexcept;

// Reads one of the words; `into` is its index.
std::optional<refusal> read_word(std::string_view member, const json::value& v,
                                 std::span<const std::string_view> words, std::string_view expected,
                                 std::size_t& into) noexcept;

// Reads a text without control characters, of at most `bytes_max` bytes after its escapes are resolved.
// `scratch` has space for it.
std::optional<refusal> read_name(std::string_view member, const json::value& v, std::size_t bytes_max,
                                 std::span<char> scratch, std::string_view& into) noexcept;

} // namespace rowe::wire::rosbridge
