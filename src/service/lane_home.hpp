// SPDX-License-Identifier: Apache-2.0
// Whether the slots of a lane whose handle is gone are all home, so that
// its memory may be built anew. Views and open requests may outlive their handle by mistake; nobody counts
// them, because the rings do: what the handle popped and what was given back, what it took for answers and
// what was pushed. Behind the handle's `closing` nothing more is popped or taken, and what was set aside
// stays there.
#pragma once
#include <cstdint>

#include <rowe/detail/lane.hpp>

namespace rowe::service {

// The service thread, or whoever has joined it, having seen `closing`. False may be a moment old; once true
// it stays so, and whatever was read in a slot happens before.
inline bool all_home(detail::lane& gone) noexcept {
  const auto arrived_home = [](const detail::filling_end& path, std::uint32_t aside) {
    if (path.out == nullptr) return true; // a window has no slots to give back
    const std::uint64_t popped = path.out->popped();
    return path.home->given() + aside == popped;
  };
  const detail::lane::user_side& had = gone.user;
  if (!arrived_home(gone.service.in, 0) || !arrived_home(gone.service.ends, had.ends_aside.count))
    return false;
  if (gone.service.out.out == nullptr) return true;
  return gone.service.out.out->pushed() + had.replies_aside.count == had.out.home->taken();
}

} // namespace rowe::service
