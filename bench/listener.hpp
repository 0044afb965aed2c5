// SPDX-License-Identifier: Apache-2.0
// A WebSocket client that sleeps until something comes, and does with it what a healthy peer does: it reads
// all, at once, and answers pings. For benches with many clients on one core; raw_client.hpp is the one that
// spins.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sys/socket.h>
#include <sys/time.h>

#include "net/descriptor.hpp"
#include "raw_client.hpp"
#include "wire/frame_parser.hpp"
#include "wire/websocket.hpp"

namespace rowe::bench {

class listener {
 public:
  // Connected and upgraded; not ok() when that failed.
  explicit listener(std::uint16_t port, std::string_view path = "/", std::string_view subprotocol = {}) {
    const sockaddr_in to = loopback_at(port);
    const timeval silence{10, 0};
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &silence, sizeof silence); // or waits longer
    send_at_once(socket_.get());
    std::string ask = "GET " + std::string{path} + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    if (!subprotocol.empty()) ask += "Sec-WebSocket-Protocol: " + std::string{subprotocol} + "\r\n";
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
          send_whole(socket_.get(), ask + "\r\n");
    std::string head;
    for (char c = 0; ok_ && !head.ends_with("\r\n\r\n"); head += c)
      ok_ = ::recv(socket_.get(), &c, 1, 0) == 1;
    ok_ = ok_ && head.starts_with("HTTP/1.1 101");
    parser_.reset(wire::role::client,
                  {.message_bytes_max = whole_bytes_max, .long_bytes_max = 1U << 26, .fragments_max = 1U << 20},
                  assembly_);
  }

  bool ok() const { return ok_; }
  int socket() const { return socket_.get(); }
  bool send(std::string_view bytes) { return ok_ = ok_ && send_whole(socket_.get(), bytes); }
  bool say(std::string_view text) { return send(raw_client::frame_of(wire::opcode::text, text)); }
  bool say_bytes(std::string_view bytes) { return send(raw_client::frame_of(wire::opcode::binary, bytes)); }

  // Waits for bytes (or not, with MSG_DONTWAIT), and gives each message, or piece of a long one, to
  // hear(step). False: nothing came, or the connection is over; ok() says which.
  template <class Hear>
  bool take(Hear&& hear, int flags = 0) {
    if (!ok_) return false;
    const ssize_t got = ::recv(socket_.get(), buffer_.data(), buffer_.size() - 64, flags);
    if (got == 0) ok_ = false;
    if (got <= 0) return false;
    std::span<std::byte> unread = std::span{buffer_}.first(static_cast<std::size_t>(got));
    while (ok_ && !unread.empty()) {
      const wire::frame_step step = parser_.next(unread);
      unread = unread.subspan(step.consumed);
      if (step.event == wire::frame_event::ping) {
        const auto* const bytes = reinterpret_cast<const char*>(step.payload.data());
        (void)send(raw_client::frame_of(wire::opcode::pong, {bytes, step.payload.size()})); // ok() says it
      } else if (step.event == wire::frame_event::close || step.event == wire::frame_event::violation) {
        ok_ = false;
      } else if (step.event != wire::frame_event::need_more && step.event != wire::frame_event::pong) {
        hear(step);
      }
    }
    return ok_;
  }
  // From another thread: whoever waits in take() is told.
  void end() const { (void)::shutdown(socket_.get(), SHUT_RDWR); } // it may be over already

 private:
  static constexpr std::size_t whole_bytes_max = 64 * 1024;

  net::descriptor socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  bool ok_ = false;
  wire::frame_parser parser_;
  std::vector<std::byte> assembly_ = std::vector<std::byte>(whole_bytes_max + 64);
  std::vector<std::byte> buffer_ = std::vector<std::byte>(whole_bytes_max + 64);
};

inline std::string_view text_of(const wire::frame_step& step) {
  return {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
}

} // namespace rowe::bench
