// SPDX-License-Identifier: Apache-2.0
// Builds the rings, windows and slots of a lane in the memory it has been given. Set-up.
#pragma once
#include <cstddef>

#include <rowe/detail/lane.hpp>
#include <rowe/options.hpp>

namespace rowe::detail {

// What a path takes that holds `depth` values of `value_bytes` (keep::all) or the newest one.
std::size_t path_bytes(rowe::keep kept, std::uint32_t depth, std::size_t value_bytes) noexcept;

// Builds it at the beginning of `memory`, which is path_bytes() long and aligned to a line, and hands out its
// ends.
void build_path(std::span<std::byte> memory, rowe::keep kept, std::uint32_t depth, std::size_t value_bytes,
                filling_end& fills, emptying_end& empties) noexcept;

} // namespace rowe::detail
