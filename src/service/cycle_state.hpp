// SPDX-License-Identifier: Apache-2.0
// What every part of the core looks at and core alone changes, but for the work, to which each part adds.
#pragma once
#include <cstddef>
#include <cstdint>

#include <rowe/rt/clock.hpp>

namespace rowe::service {

struct cycle_state {
  rt::time_point now{};           // of this cycle: the same for all that is done in it
  std::size_t work_bytes = 0;     // of the message that is carried out: bytes composed, or what takes as long
  std::uint64_t places_freed = 0; // how often room came for what waits for it, beside queues and slots
  bool closing = false;           // the endpoint closes: nothing new is taken
};

} // namespace rowe::service
