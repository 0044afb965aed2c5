// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/slab.hpp>

#include <algorithm>

namespace rowe::rt {

const char* slab::check() const noexcept {
  if (slots_ == 0) return nullptr;
  if (stride_ % line_bytes != 0) return "slots share no line";
  if (stride_ < headroom_bytes + payload_bytes_ + tailroom_bytes) return "a slot has room for all its parts";
  for (std::uint32_t number = 0; number < slots_; ++number) {
    const std::byte* const behind = slot(number).data() + payload_bytes_;
    const std::byte* const next = base_ + (number + 1) * stride_;
    if (!std::all_of(behind, next, [](std::byte b) { return b == std::byte{0}; }))
      return "nothing was written behind a payload";
  }
  return nullptr;
}

} // namespace rowe::rt
