// SPDX-License-Identifier: Apache-2.0
// The bytes of an established connection: those of its socket, or those that a TLS session makes of them.
// Service thread; never waits. What a session allocates is said there.
#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include <sys/types.h>

#include <rowe/rt/clock.hpp>

#include "net/base/descriptor.hpp"
#include "net/tls/session.hpp"

namespace rowe::net {

class stream {
 public:
  stream() noexcept = default; // none: its session is on the way, or it has ended
  explicit stream(descriptor plain) noexcept : plain_{std::move(plain)} {}
  explicit stream(std::unique_ptr<tls::session> secure) noexcept : secure_{std::move(secure)} {}

  explicit operator bool() const noexcept { return get() >= 0; }
  int get() const noexcept { return secure_ ? secure_->descriptor_number() : plain_.get(); }

  // As recv(): 0 at an orderly end, -1 with an errno.
  ssize_t receive(std::span<std::byte> to, rt::time_point now) noexcept;
  // Whether receive() has something of which the kernel knows nothing.
  bool holds_input() const noexcept { return secure_ && secure_->holds_input(); }

  struct sent {
    std::size_t taken = 0;
    int broken = 0; // an errno, if nothing can be sent any more
  };
  // Sends in parts of at most `segment_bytes`. If it did not take all, or holds_output(), there is no room.
  sent send(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept;
  // Whether something that was taken is not in the kernel yet. Then flush() must be called when there is
  // room.
  bool holds_output() const noexcept { return secure_ && secure_->holds_output(); }
  // True when nothing is held.
  bool flush() noexcept { return !secure_ || secure_->flush(); }

  // Says that nothing more comes, behind what was sent. False if the other end is gone. If it holds_output()
  // afterwards, flush() and then finish() again.
  bool finish() noexcept;
  // Closes the socket. What is left of a session is returned, to be freed elsewhere.
  std::unique_ptr<tls::session> close() noexcept;

 private:
  sent send_plain(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept;

  descriptor plain_;
  std::unique_ptr<tls::session> secure_;
  bool finished_ = false;
};

} // namespace rowe::net
