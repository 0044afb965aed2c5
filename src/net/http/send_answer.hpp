// SPDX-License-Identifier: Apache-2.0
// Sends one small answer to a socket to which nothing was written before, so its buffer is empty, and larger
// than the answer. Never waits, never allocates.
#pragma once
#include <sys/socket.h>

#include <string_view>

#include "wire/http/http_answer.hpp"

namespace rowe::net {

inline void send_answer(int fd, std::string_view bytes) noexcept {
  (void)::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT); // a peer that is gone needs none
}

// The same. False: not all of it was taken.
inline bool send_whole(int fd, std::string_view bytes) noexcept {
  return ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(bytes.size());
}

inline void send_answer(int fd, const wire::http_rejection& rejection) noexcept {
  char bytes[wire::http_rejection_bytes_max];
  send_answer(fd, wire::write_rejection(bytes, rejection));
}

} // namespace rowe::net
