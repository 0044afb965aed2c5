// SPDX-License-Identifier: Apache-2.0
// The seed of a randomised test: a new one each run, told when the test fails, given again by ROWE_TEST_SEED.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <random>

namespace rowe::tests {

inline std::uint64_t seed() {
  if (const char* const given = std::getenv("ROWE_TEST_SEED")) return std::strtoull(given, nullptr, 10);
  return std::random_device{}();
}

} // namespace rowe::tests

// Names the seed in every failure of the scope it stands in.
#define ROWE_TRACE_SEED(value) SCOPED_TRACE(::testing::Message() << "again with ROWE_TEST_SEED=" << (value))
