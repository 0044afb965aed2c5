// SPDX-License-Identifier: Apache-2.0
// Amounts as people read them.
#pragma once
#include <cstdint>
#include <string>

namespace rowe::tools {

// "1.25 GB": four digits at most.
std::string bytes_text(std::uint64_t bytes);

// The whole number below what somebody said; what is none, or below 0, is 0, and none is beyond 2^63.
std::uint64_t whole_of(double said) noexcept;

} // namespace rowe::tools
