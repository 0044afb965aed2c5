// SPDX-License-Identifier: Apache-2.0
// What tests of whole endpoints see of one, and how they wait for it.
#pragma once
#include <gtest/gtest.h>
#include <poll.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

#include <rowe/rowe.hpp>

namespace rowe::tests {

inline std::string url_of(const endpoint& of) { return "ws://127.0.0.1:" + std::to_string(of.port()); }

inline std::uint64_t count_of(const endpoint& of, std::string_view name) {
  for (const auto& one : of.counts()) {
    if (one.name == name) return one.value;
  }
  ADD_FAILURE() << "no counter " << name;
  return 0;
}

// Whether `ready` comes true in so much time. Between two looks others may have the processor, for some
// milliseconds if need be.
template <class Ready>
bool eventually(Ready&& ready, duration most, duration between = {}) {
  const auto until = rt::monotonic_clock::now() + most;
  while (!ready()) {
    if (rt::monotonic_clock::now() > until) return false;
    std::this_thread::yield();
    if (between != duration{})
      (void)::poll(nullptr, 0, static_cast<int>(between / std::chrono::milliseconds{1}));
  }
  return true;
}

} // namespace rowe::tests
