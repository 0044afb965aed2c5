// SPDX-License-Identifier: Apache-2.0
// What C programs say of times, sizes and options is taken here, before anything is reckoned with it.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <rowe/result.hpp>
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

// Structs of options from C programs, which may be older than the library: shorter, then, and what they lack
// is zero, the default. A longer one is of a newer program, which asks for what this library does not have.

// What the program knew of `given`, which may be NULL: all defaults. Errors: bad_argument (`bytes` is none
// of a version of this struct).
template <class Options>
result<Options> whole(const Options* given) noexcept {
  static_assert(std::is_trivially_copyable_v<Options> &&
                std::is_same_v<decltype(Options::bytes), std::size_t>);
  Options all{};
  if (given == nullptr) return all;
  if (given->bytes < sizeof given->bytes || given->bytes > sizeof all) {
    return error{errc::bad_argument, static_cast<std::int64_t>(given->bytes), sizeof all};
  }
  std::memcpy(&all, given, given->bytes);
  return all;
}

// A value that stands for its default where it is 0.
template <class Number>
Number or_default(Number given, Number otherwise) noexcept {
  return given == Number{} ? otherwise : given;
}

} // namespace rowe::capi
