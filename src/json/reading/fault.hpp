// SPDX-License-Identifier: Apache-2.0
// Finds where a JSON text is wrong, by a plain scan of the grammar of RFC 8259, byte by byte. The reader
// calls it for texts that its own check of tokens does not accept. This scan decides, and says which byte is
// wrong. tests/fuzz/json_reader.cpp compares it with simdjson. Pure, on any thread; never waits, never
// allocates; steps in proportion to the text.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace rowe::json {

enum class fault_kind : std::uint8_t {
  none,
  malformed, // no JSON, no UTF-8, an unpaired surrogate, or a number that no double can hold
  too_deep,
};

struct fault {
  fault_kind what = fault_kind::none;
  std::size_t at = 0; // index of the first wrong byte; the text's length where it ends too early
};

inline constexpr std::size_t fault_depth_limit = 1024; // the most levels that can be asked for

// `depth_max`: how many objects and arrays may be open at once, at most fault_depth_limit.
fault find_fault(std::string_view text, std::size_t depth_max) noexcept;

// The nearest double of a number token (RFC 8259 grammar). A number that is too small is a zero with the
// token's sign. Nothing if it is beyond the largest double, or is no such token.
std::optional<double> nearest_double(std::string_view token) noexcept;

} // namespace rowe::json
