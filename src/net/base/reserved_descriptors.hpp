// SPDX-License-Identifier: Apache-2.0
// Descriptors that are reserved from the beginning for the stop, for when the process has no other left. One
// that is needed is closed, so that the next call finds its number free. It is taken back before anything
// else here takes a descriptor. Other threads of the process may be faster; then there is one less meanwhile.
//
// Any thread, after keep(). A slot is a number, which whoever exchanges it for `none` owns.
#pragma once
#include <sys/eventfd.h>

#include <atomic>
#include <cstddef>
#include <vector>

#include "net/base/descriptor.hpp"

namespace rowe::net {

class reserved_descriptors {
 public:
  reserved_descriptors() = default;
  ~reserved_descriptors() { (void)give(all_.size()); }
  reserved_descriptors(const reserved_descriptors&) = delete;
  reserved_descriptors& operator=(const reserved_descriptors&) = delete;

  // Set-up: allocates, and takes as many as there are.
  void keep(std::size_t count) {
    all_ = std::vector<slot>(count);
    take_back();
  }
  // Never waits; enters the kernel while one is missing.
  void take_back() noexcept {
    for (slot& one : all_) {
      if (one.number != none) continue;
      descriptor taken{::eventfd(0, EFD_CLOEXEC)};
      if (!taken) return;
      int expected = none;
      if (one.number.compare_exchange_strong(expected, taken.get())) (void)taken.release();
    }
  }
  // The next `count` calls that need one succeed. False: so many are not reserved.
  bool give(std::size_t count = 1) noexcept {
    for (slot& one : all_) {
      if (count == 0) return true;
      if (const descriptor given{one.number.exchange(none)}) --count;
    }
    return count == 0;
  }

 private:
  static constexpr int none = -1;
  struct slot {
    std::atomic<int> number{none};
  };
  std::vector<slot> all_;
};

} // namespace rowe::net
