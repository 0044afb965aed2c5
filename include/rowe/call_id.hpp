// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include <rowe/rt/attributes.hpp>

namespace rowe {

// A call that a queue pair or a caller has in flight. Names it until its end was taken; then it is stale, and
// stays so.
struct call_id {
  std::uint32_t index = 0;
  std::uint32_t generation = 0; // 0: no call

  ROWE_RT friend constexpr bool operator==(const call_id&, const call_id&) noexcept = default;
};

} // namespace rowe
