// SPDX-License-Identifier: Apache-2.0
// A WebSocket client that is as fast as its kernel: frames are made before they are needed, and it spins on a
// socket that does not block. What benches measure round trips with.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

inline sockaddr_in loopback_at(std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return at;
}

inline void send_at_once(int socket) {
  const int yes = 1;
  (void)::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
}

// Sends all of it; false when the connection is broken.
inline bool send_whole(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

// Spins until all of `into` has come; false when the connection is broken.
inline bool spin_for(int socket, std::span<char> into) {
  while (!into.empty()) {
    const ssize_t got = ::recv(socket, into.data(), into.size(), MSG_DONTWAIT);
    if (got == 0) return false;
    if (got > 0) into = into.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

// A connection over loopback that both ends of are here, with nothing on it. Not ok() when there is none.
class socket_pair {
 public:
  socket_pair() {
    const net::descriptor listening{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    sockaddr_in at = loopback_at(0);
    socklen_t bytes = sizeof at;
    ok_ = ::bind(listening.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
          ::listen(listening.get(), 1) == 0 &&
          ::getsockname(listening.get(), reinterpret_cast<sockaddr*>(&at), &bytes) == 0 &&
          ::connect(ours_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
    theirs_.reset(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
    send_at_once(ours_.get());
    send_at_once(theirs_.get());
  }
  bool ok() const { return ok_; }
  int ours() const { return ours_.get(); }
  int theirs() const { return theirs_.get(); }

 private:
  net::descriptor ours_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  net::descriptor theirs_;
  bool ok_ = false;
};

class raw_client {
 public:
  // Connected and upgraded; not ok() when that failed.
  explicit raw_client(std::uint16_t port) {
    const sockaddr_in to = loopback_at(port);
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
          send_whole(socket_.get(), "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                                        "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                                        "Sec-WebSocket-Version: 13\r\n"
                                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    send_at_once(socket_.get());
    std::string head;
    for (char c = 0; ok_ && !head.ends_with("\r\n\r\n"); head += c)
      ok_ = ::recv(socket_.get(), &c, 1, 0) == 1;
    ok_ = ok_ && head.starts_with("HTTP/1.1 101");
    parser_.reset(wire::role::client, {.message_bytes_max = message_bytes_max, .fragments_max = 16},
                  assembly_);
  }

  bool ok() const { return ok_; }
  int socket() const { return socket_.get(); }
  bool send(std::string_view bytes) { return ok_ = ok_ && send_whole(socket_.get(), bytes); }

  // Spins until something has come, which take() looks into; false when the connection is broken.
  bool wait() {
    while (ok_ && unread_.empty()) {
      const ssize_t got = ::recv(socket_.get(), buffer_.data(), buffer_.size() - 64, MSG_DONTWAIT);
      if (got == 0) ok_ = false;
      if (got > 0) unread_ = std::span{buffer_}.first(static_cast<std::size_t>(got));
    }
    return ok_;
  }

  // Spins for the next message; its payload is good until the next call. Nothing when the connection is
  // broken. What stands behind it is taken next.
  std::span<std::byte> take() {
    while (wait()) {
      const wire::frame_step step = parser_.next(unread_);
      unread_ = unread_.subspan(step.consumed);
      if (step.event == wire::frame_event::text) return step.payload;
      if (step.event == wire::frame_event::ping)
        pongs_ += frame_of(wire::opcode::pong,
                           {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()});
      if (step.event == wire::frame_event::close) ok_ = false;
    }
    return {};
  }

  // Answers the pings that were taken: between two measurements.
  void answer_pings() {
    if (pongs_.empty()) return;
    (void)send(pongs_); // ok() says it
    pongs_.clear();
  }

  // As a client sends it; masked with zeros, which makes it the same work for a server.
  static std::string frame_of(wire::opcode what, std::string_view payload) {
    std::string frame(wire::frame_header_bytes(payload.size(), wire::role::client), '\0');
    (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), what, payload.size(),
                                   wire::mask_key{}); // its size is known above
    return frame.append(payload);
  }

 private:
  static constexpr std::size_t message_bytes_max = 64 * 1024;

  net::descriptor socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  bool ok_ = false;
  wire::frame_parser parser_;
  std::vector<std::byte> assembly_ = std::vector<std::byte>(message_bytes_max + 64);
  std::vector<std::byte> buffer_ = std::vector<std::byte>(message_bytes_max + 64);
  std::span<std::byte> unread_;
  std::string pongs_;
};

} // namespace rowe::bench
