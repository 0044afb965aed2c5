// SPDX-License-Identifier: Apache-2.0
// How much a stress test does: a stated small amount by default, ROWE_STRESS_FACTOR times that when asked to.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace rowe::tests {

inline std::uint64_t stressed(std::uint64_t amount) {
  const char* const given = std::getenv("ROWE_STRESS_FACTOR");
  return amount * (given == nullptr ? 1 : std::max<std::uint64_t>(std::strtoull(given, nullptr, 10), 1));
}

} // namespace rowe::tests
