// SPDX-License-Identifier: Apache-2.0
// Times as people write and read them.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

enum class time_zone : std::uint8_t { local, utc };

// Nanoseconds since 1970 as ISO 8601 with `decimals` of a second: "2026-11-30T05:09:58.123+01:00"; a zone
// that is UTC is "Z".
std::string iso_text(std::int64_t since_1970_ns, time_zone zone, int decimals = 3);

// Reads one, with 'T' or a blank between day and time; without a zone it is local. Nothing: it is none, or
// lies before 1970 or after 2262.
std::optional<std::int64_t> iso_time_of(std::string_view text);

// "1:23.456", "1:02:03.456"; with a sign below 0.
std::string clock_text(rt::duration time, int decimals = 3);

// A place in a recording: an offset from its begin, or from its end where it is negative ("-10s"), or a time.
struct from_begin {
  rt::duration offset{};
};
struct from_end {
  rt::duration offset{}; // 0 or more
};
struct absolute_time {
  std::int64_t since_1970_ns = 0;
};
using place_in_time = std::variant<from_begin, from_end, absolute_time>;

// "90s", "1:30", "-1:30", "1:02:03.5", or what iso_time_of() reads. Nothing: it is none.
std::optional<place_in_time> place_in_time_of(std::string_view text);

// A number with so many decimals.
std::string decimal_text(double number, int decimals);

} // namespace rowe::tools
