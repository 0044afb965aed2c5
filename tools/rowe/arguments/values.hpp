// SPDX-License-Identifier: Apache-2.0
// The values people write on a command line, read strictly: a text is wholly a value, or it is none. Nothing
// here allocates.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

// "-12".
std::optional<std::int64_t> integer_of(std::string_view text) noexcept;

// "50ms", "1.5s", "200us", "10m" or "10min", "1h"; no sign, and only 0 may go without its unit. What is
// longer than 292 years is rt::for_ever.
std::optional<rt::duration> duration_of(std::string_view text) noexcept;

// "1kHz", "250Hz", "0.5"; in hertz, above 0.
std::optional<double> rate_of(std::string_view text) noexcept;

// "1GiB", "500MB", "4096"; in bytes, above 0. kB and so on are powers of 1000, KiB of 1024.
std::optional<std::uint64_t> bytes_of(std::string_view text) noexcept;

// How many single-letter slips (one letter added, lost, changed, or two neighbours swapped) turn one word
// into the other; words of more than 128 letters are as far apart as the longer one is long.
std::size_t slips_between(std::string_view one, std::string_view other) noexcept;

} // namespace rowe::tools
