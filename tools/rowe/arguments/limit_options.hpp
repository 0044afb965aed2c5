// SPDX-License-Identifier: Apache-2.0
// Limits that the user of a program chooses in the environment: ROWE_LIMITS_TOPICS_MAX=256. `rowe serve` has
// them among its other settings (configuration.hpp).
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include <rowe/limits.hpp>

namespace rowe::tools {

// The limits of an endpoint whose handles take `handle_bytes_min` at least. Nothing: what was asked for makes
// no sense, and stderr says so; `verb` ends with exit_code::usage.
std::optional<limits> limits_for(std::string_view verb, std::size_t handle_bytes_min = 0);

} // namespace rowe::tools
