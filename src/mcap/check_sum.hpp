// SPDX-License-Identifier: Apache-2.0
// CRC-32 as Ethernet and zlib have it. Never allocates, never waits.
#pragma once
#include <cstdint>
#include <string_view>

namespace rowe::mcap {

std::uint32_t check_sum(std::string_view bytes) noexcept;

} // namespace rowe::mcap
