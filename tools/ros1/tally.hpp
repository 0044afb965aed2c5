// SPDX-License-Identifier: Apache-2.0
// What passed through a topic or a service, and what did not. Any thread counts; the main thread reports.
#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

namespace rowe::ros1 {

struct tally {
  std::atomic<std::uint64_t> passed{0};
  std::atomic<std::uint64_t> no_peer{0}; // nobody was connected
  std::atomic<std::uint64_t> full{0};    // more at once than there is room for
  std::atomic<std::uint64_t> too_big{0};
  std::atomic<std::uint64_t> wrong{0};  // not of the topic's type
  std::atomic<std::uint64_t> failed{0}; // calls that ended without an answer

  std::uint64_t dropped() const noexcept { return no_peer + full + too_big + wrong + failed; }

  // The first reason since it was last taken.
  void because(std::string why) {
    const std::lock_guard guard{mutex_};
    if (why_.empty()) why_ = std::move(why);
  }
  std::string take_reason() {
    const std::lock_guard guard{mutex_};
    return std::exchange(why_, {});
  }

 private:
  std::mutex mutex_; // guards why_
  std::string why_;
};

} // namespace rowe::ros1
