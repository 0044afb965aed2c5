// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include <rowe/rt/attributes.hpp>

namespace rowe {

// Names a call that a lane or a caller has in flight. After the call's completion was taken, the id is stale
// for ever.
struct call_id {
  std::uint32_t index = 0;
  std::uint32_t generation = 0; // 0: no call

  ROWE_RT friend constexpr bool operator==(const call_id&, const call_id&) noexcept = default;
};

} // namespace rowe
