// SPDX-License-Identifier: Apache-2.0
// How much a stress test does: a stated small amount by default, ROWE_STRESS_FACTOR times that when asked to.
#pragma once
#include <algorithm>
#include <cstdint>

#include "rt/asked.hpp"

namespace rowe::tests {

inline std::uint64_t stressed(std::uint64_t amount) {
  return amount * std::max<std::uint64_t>(asked_of("ROWE_STRESS_FACTOR", 1), 1);
}

} // namespace rowe::tests
