// SPDX-License-Identifier: Apache-2.0
// What C programs say of times and sizes is taken here, before anything is reckoned with it.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::capi {

// A time of an option, in units of `Unit`. One that a duration cannot hold is the longest, or the most
// negative one, which whoever checks the option refuses.
template <class Unit>
ROWE_RT constexpr rt::duration time_of_option(long count) noexcept {
  constexpr std::intmax_t in_one = rt::duration{Unit{1}}.count();
  if (count > rt::duration::max().count() / in_one) return rt::duration::max();
  if (count < rt::duration::min().count() / in_one) return rt::duration::min();
  return Unit{count};
}

// Milliseconds that a call may take: negative is for ever, and so is what a duration cannot hold.
ROWE_RT inline rt::duration duration_of(long ms) noexcept {
  return ms < 0 ? rt::for_ever : std::min(time_of_option<std::chrono::milliseconds>(ms), rt::for_ever);
}

// A loop's time. The monotonic clock begins at 0, so a difference of two of its times always has room.
ROWE_RT constexpr rt::time_point time_of(std::int64_t ns) noexcept {
  return rt::time_point{rt::duration{std::max<std::int64_t>(ns, 0)}};
}

// Whether there can be something of so many bytes: no, if it is -1, which read() returns for an error.
ROWE_RT constexpr bool is_size(std::size_t bytes) noexcept { return bytes <= PTRDIFF_MAX; }

} // namespace rowe::capi
