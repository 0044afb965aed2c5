// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace rowe::net {

// Whether a call failed for want of one.
constexpr bool has_no_descriptor(int code) noexcept { return code == EMFILE || code == ENFILE; }

// Owns a file descriptor, and closes it at the end. Closing does not take it out of an epoll: the
// registration belongs to the open file, which a duplicate or a forked child may keep alive
// (poll_set::remove).
class descriptor {
 public:
  descriptor() noexcept = default;
  explicit descriptor(int number) noexcept : number_{number} {}
  descriptor(descriptor&& other) noexcept : number_{std::exchange(other.number_, -1)} {}
  descriptor& operator=(descriptor&& other) noexcept {
    if (this != &other) reset(std::exchange(other.number_, -1));
    return *this;
  }
  ~descriptor() { reset(); }

  int get() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }
  int release() noexcept { return std::exchange(number_, -1); }
  void reset(int number = -1) noexcept {
    if (number_ >= 0) ::close(number_);
    number_ = number;
  }

 private:
  int number_ = -1;
};

} // namespace rowe::net
