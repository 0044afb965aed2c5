// SPDX-License-Identifier: Apache-2.0
// Weights of rows, to compare the counts of references to all rows of a table in one pass and without memory.
// The weights are hashes. Except by coincidence, two sums are equal only if each row was counted as often in
// both. For check().
#pragma once
#include <cstdint>

#include "service/base/ids.hpp"

namespace rowe::service {

constexpr std::uint64_t weight(std::uint32_t of) noexcept {
  std::uint64_t z = (of + std::uint64_t{1}) * 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

template <class Tag>
constexpr std::uint64_t weight(id<Tag> of) noexcept {
  return weight(of.value);
}

} // namespace rowe::service
