// SPDX-License-Identifier: Apache-2.0
#include "net/connections/stream.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "net/base/socket_options.hpp"

namespace rowe::net {

ssize_t stream::receive(std::span<std::byte> to, rt::time_point now) noexcept {
  if (secure_) return secure_->read(to, now);
  return ::recv(plain_.get(), to.data(), to.size(), MSG_DONTWAIT);
}

stream::sent stream::send(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept {
  if (!secure_) return send_plain(bytes, segment_bytes);
  const std::size_t record_bytes = segment_bytes > 2 * tls::session::record_overhead
                                       ? segment_bytes - tls::session::record_overhead
                                       : segment_bytes;
  const std::size_t taken = secure_->write(bytes, record_bytes);
  return {.taken = taken, .broken = secure_->broken()};
}

stream::sent stream::send_plain(std::span<const std::byte> bytes, std::size_t segment_bytes) noexcept {
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

bool stream::finish() noexcept {
  if (secure_ && !std::exchange(finished_, true)) secure_->finish();
  if (holds_output()) return true;
  return ::shutdown(get(), SHUT_WR) == 0;
}

std::unique_ptr<tls::session> stream::close() noexcept {
  plain_.reset();
  if (secure_) secure_->close_socket();
  return std::exchange(secure_, nullptr);
}

} // namespace rowe::net
