// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/notification.hpp>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <type_traits>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace rowe::rt {

// The kernel takes the address of the plain integer.
static_assert(sizeof(futex::word) == sizeof(std::uint32_t) && alignof(futex::word) == alignof(std::uint32_t));
static_assert(std::is_standard_layout_v<futex::word>);

bool futex::wait(word& word, std::uint32_t expected, time_point deadline) noexcept {
  constexpr std::int64_t per_second = 1'000'000'000;
  // A deadline before the clock's origin has passed; the kernel would refuse it as malformed.
  const std::int64_t nanoseconds = std::max<std::int64_t>(nanoseconds_of(deadline), 0);
  const timespec until{.tv_sec = nanoseconds / per_second, .tv_nsec = nanoseconds % per_second};
  // WAIT_BITSET, since plain WAIT takes a relative time, which would begin anew after every early return.
  const long answer = ::syscall(SYS_futex, &word, FUTEX_WAIT_BITSET | FUTEX_PRIVATE_FLAG, expected,
                                deadline == never ? nullptr : &until, nullptr, FUTEX_BITSET_MATCH_ANY);
  return answer == 0 || errno != ETIMEDOUT;
}

void futex::wake(word& word) noexcept {
  // The answer is how many woke: one, or none if the sleeper has left by itself.
  (void)::syscall(SYS_futex, &word, FUTEX_WAKE | FUTEX_PRIVATE_FLAG, 1, nullptr, nullptr, 0);
}

} // namespace rowe::rt
