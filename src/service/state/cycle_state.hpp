// SPDX-License-Identifier: Apache-2.0
// What every part of the core reads. Only the core changes it, except `work_bytes` and `places_freed`, to
// which the parts add.
#pragma once
#include <cstddef>
#include <cstdint>

#include <algorithm>

#include <rowe/rt/clock.hpp>

namespace rowe::service {

// The time of a slot's header; the inverse of rt::nanoseconds_of().
inline rt::time_point time_of(std::int64_t ns) noexcept { return rt::time_point{rt::duration{ns}}; }

struct cycle_state {
  rt::time_point now{};         // when this cycle began; all that it does sees this time
  rt::time_point awake_since{}; // when this process went on after a pause in which it did not run
  // Work done for the current message, in bytes composed; other work counts as the bytes that take as long.
  std::size_t work_bytes = 0;
  std::uint64_t places_freed = 0; // how often room came elsewhere than in queues and slots
  bool closing = false;           // the endpoint is closing: nothing new is taken

  // How long we have waited for somebody else since then. Time in which this process did not run does not
  // count.
  rt::duration waited_since(rt::time_point then) const noexcept { return now - std::max(then, awake_since); }

  // When a submission of this process expires. One that expires when it was stamped lives until the cycle
  // that takes it, however long it was queued.
  rt::time_point expiry_of(rt::time_point stamped, rt::time_point expires) const noexcept {
    return expires == stamped ? now : expires;
  }
};

} // namespace rowe::service
