// SPDX-License-Identifier: Apache-2.0
// The bytes of an established connection: those of its socket, or those that a TLS session makes of them.
// Service thread; never waits. What a session allocates is said there.
#pragma once
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include <sys/types.h>

#include <rowe/rt/clock.hpp>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"
#include "net/base/socket_options.hpp"
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
  ssize_t receive(std::span<std::byte> to, rt::time_point now) noexcept {
    if (secure_) return secure_->read(to, now);
    return ::recv(plain_.get(), to.data(), to.size(), MSG_DONTWAIT);
  }
  // Whether receive() has something of which the kernel knows nothing.
  bool holds_input() const noexcept { return secure_ && secure_->holds_input(); }

  struct sent {
    std::size_t taken = 0;
    int broken = 0; // an errno, if nothing can be sent any more
  };
  // Sends in parts of at most `segment_bytes`. If it did not take all, or holds_output(), there is no room.
  sent send(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept {
    if (!secure_) return send_plain(bytes, segment_bytes);
    const std::size_t record_bytes = segment_bytes > 2 * tls::session::record_overhead
                                         ? segment_bytes - tls::session::record_overhead
                                         : segment_bytes;
    const std::size_t taken = secure_->write(bytes, record_bytes);
    return {.taken = taken, .broken = secure_->broken()};
  }
  // Whether something that was taken is not in the kernel yet. Then flush() must be called when there is
  // room.
  bool holds_output() const noexcept { return secure_ && secure_->holds_output(); }
  // True when nothing is held.
  bool flush() noexcept { return !secure_ || secure_->flush(); }

  // Says that nothing more comes, behind what was sent. False if the other end is gone. If it holds_output()
  // afterwards, flush() and then finish() again.
  bool finish() noexcept {
    if (secure_ && !std::exchange(finished_, true)) secure_->finish();
    if (holds_output()) return true;
    return ::shutdown(get(), SHUT_WR) == 0;
  }
  // Closes the socket. What is left of a session is returned, to be freed elsewhere.
  std::unique_ptr<tls::session> close() noexcept {
    plain_.reset();
    if (secure_) secure_->close_socket();
    return std::exchange(secure_, nullptr);
  }

 private:
  sent send_plain(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept {
    std::size_t taken = 0;
    while (taken < bytes.size()) {
      const auto segment = bytes.subspan(taken, std::min(bytes.size() - taken, segment_bytes));
      const ssize_t now = ::send(plain_.get(), segment.data(), segment.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (now < 0) return {.taken = taken, .broken = has_no_room(errno) ? 0 : errno};
      taken += static_cast<std::size_t>(now);
      if (static_cast<std::size_t>(now) < segment.size()) break;
    }
    return {.taken = taken};
  }

  descriptor plain_;
  std::unique_ptr<tls::session> secure_;
  bool finished_ = false;
};

} // namespace rowe::net
