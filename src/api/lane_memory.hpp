// SPDX-License-Identifier: Apache-2.0
// Builds lanes as their requests say: the rings, windows, slots and tables in the memory they have been
// given, and what compiled schemas they need. Set-up.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include <rowe/detail/lane.hpp>
#include <rowe/detail/lane_request.hpp>
#include <rowe/options.hpp>

#include "json/decoder.hpp"
#include "json/encoder.hpp"

namespace rowe::detail {

// What a path takes that holds `depth` values of `value_bytes` (keep::all) or the newest one.
std::size_t path_bytes(rowe::keep kept, std::uint32_t depth, std::size_t value_bytes) noexcept;

// Builds it at the beginning of `memory`, which is path_bytes() long and aligned to a line, and hands out its
// ends.
void build_path(std::span<std::byte> memory, rowe::keep kept, std::uint32_t depth, std::size_t value_bytes,
                producer_end& fills, consumer_end& empties) noexcept;

// What the paths and tables of a lane take together.
std::size_t lane_bytes(const lane_request& asked) noexcept;

// Writes everything of a free lane that set-up writes, but for its encoder and decoder, and builds what the
// request asks for in `built.memory`: lane_bytes() or more, aligned to a line. The name and the type have at
// most lane::name_bytes_max bytes.
void build_lane(lane& built, const lane_request& asked,
                std::span<const rt::std_atomics::variable<std::uint32_t>> peer_generations) noexcept;

// The compiled schemas of a lane. Outlive it.
struct lane_codecs {
  std::optional<json::encoder> encoder;
  std::optional<json::decoder> decoder;

  // Allocates. Errors: bad_argument (a schema that nests too deep, or is too large), no_memory.
  static result<lane_codecs> compile(const lane_request& asked);
};

} // namespace rowe::detail
