// SPDX-License-Identifier: Apache-2.0
// Ends the test program when a wait that must end does not, so that a hang shows as a failure with a name. It
// is a thread of its own, which sleeps; the tests it guards never measure time.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <thread>

namespace rowe::tests {

class watchdog {
 public:
  explicit watchdog(const char* what, std::chrono::seconds limit = std::chrono::seconds{60})
      : thread_{[this, what, limit] { watch(what, limit); }} {}
  watchdog(const watchdog&) = delete;
  watchdog& operator=(const watchdog&) = delete;
  ~watchdog() {
    {
      const std::lock_guard lock{mutex_};
      done_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

 private:
  void watch(const char* what, std::chrono::seconds limit) {
    std::unique_lock lock{mutex_};
    // system_clock, because gcc 12's TSan does not know the call that a steady deadline makes.
    if (changed_.wait_until(lock, std::chrono::system_clock::now() + limit, [this] { return done_; })) return;
    std::fprintf(stderr, "watchdog: %s did not end within %lld s\n", what,
                 static_cast<long long>(limit.count()));
    std::abort();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

} // namespace rowe::tests
