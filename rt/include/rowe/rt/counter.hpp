// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// A number that one thread writes and any thread may read. It is no more than a number: reading it says
// nothing about other memory, so every access is relaxed; and since there is one writer, raising it is a
// plain addition and no locked instruction.
class counter {
 public:
  constexpr counter() noexcept = default;
  explicit constexpr counter(std::uint64_t start) noexcept : count_{start} {}

  // The one writing thread. Never waits.
  ROWE_RT void add(std::uint64_t more = 1) noexcept { set(get() + more); }
  ROWE_RT void set(std::uint64_t count) noexcept {
    count_.store(count,
                 std::memory_order_relaxed); // relaxed: pairs with the load in get(); only the number counts
  }
  // Any thread. Never waits.
  ROWE_RT std::uint64_t get() const noexcept {
    return count_.load(std::memory_order_relaxed); // relaxed: pairs with the store in set()
  }

 private:
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  std::atomic<std::uint64_t> count_{0};
};

} // namespace rowe::rt
