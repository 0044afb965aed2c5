// SPDX-License-Identifier: Apache-2.0
// Amounts as people read them.
#pragma once
#include <cstdint>
#include <string>

namespace rowe::tools {

// "1.25 GB": four digits at most.
std::string bytes_text(std::uint64_t bytes);

} // namespace rowe::tools
