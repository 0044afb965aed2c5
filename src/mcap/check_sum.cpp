// SPDX-License-Identifier: Apache-2.0
#include "mcap/check_sum.hpp"

#include <zlib.h>

namespace rowe::mcap {

std::uint32_t check_sum(std::string_view bytes) noexcept {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): zlib takes unsigned bytes
  const auto* const begin = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::uint32_t>(crc32_z(0, begin, bytes.size()));
}

} // namespace rowe::mcap
