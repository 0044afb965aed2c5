// SPDX-License-Identifier: Apache-2.0
// Whether what a person wrote is JSON, before it is sent: the service thread would refuse it as well, but
// could not say to whom and where.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace rowe::tools {

struct json_fault {
  std::size_t at; // bytes from the begin
  std::string_view what;
};

// How deep objects and arrays may be nested, as in the library's own limit.
inline constexpr std::size_t json_depth_max = 64;

// Nothing: `text` is one JSON object as RFC 8259 has it, in valid UTF-8.
std::optional<json_fault> object_fault(std::string_view text) noexcept;

// "is no JSON object: ... (at byte 7)".
std::string sentence_of(const json_fault& fault);

} // namespace rowe::tools
