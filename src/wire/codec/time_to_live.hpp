// SPDX-License-Identifier: Apache-2.0
// The member `ttl_ms` of a message: what is left of its time to live, in milliseconds, when the message is
// written. Every codec that has it reads and writes it alike. Pure functions; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/rt/clock.hpp>

#include "wire/codec/refusal.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire {

inline constexpr std::string_view ttl_member = "ttl_ms";
inline constexpr rt::duration ttl_unit = std::chrono::microseconds{1}; // of what is written
// Bytes of `"ttl_ms":` and the longest time.
inline constexpr std::size_t ttl_text_bytes_max = 26;

// Reads a number of milliseconds, 0 or more, into nanoseconds; unlimited if 64 bits cannot hold it. Returns
// why it is refused.
std::optional<refusal> read_ttl(const json::value& v, std::int64_t& into_ns) noexcept;

// Writes `"ttl_ms":20` or `"ttl_ms":19.873` into `out`, of ttl_text_bytes_max bytes: whole units, rounded
// down. Returns how many bytes. `left_ns` must not be negative.
std::size_t write_ttl(std::span<std::byte> out, std::int64_t left_ns) noexcept;

} // namespace rowe::wire
