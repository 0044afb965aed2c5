// SPDX-License-Identifier: Apache-2.0
// Texts put together. (By appending: g++ 12 at -O3 warns without cause about `"[" + std::string{...}`.)
#pragma once
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>

namespace rowe::tests {

inline std::string concat(std::initializer_list<std::string_view> pieces) {
  std::string all;
  for (const std::string_view piece : pieces) all.append(piece);
  return all;
}

inline std::string repeat(std::string_view piece, std::size_t count) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all.append(piece);
  return all;
}

} // namespace rowe::tests
