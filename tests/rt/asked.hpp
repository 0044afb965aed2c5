// SPDX-License-Identifier: Apache-2.0
// How much a test does: a stated amount, or what the environment asks for.
#pragma once
#include <cstdint>
#include <cstdlib>

namespace rowe::tests {

inline std::uint64_t asked_of(const char* variable, std::uint64_t usual) {
  const char* const given = std::getenv(variable);
  return given != nullptr ? std::strtoull(given, nullptr, 0) : usual;
}

} // namespace rowe::tests
